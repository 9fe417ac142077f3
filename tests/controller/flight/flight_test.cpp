#include "tests/controller/loop/harness.hpp"
#include "tests/controller/loop/storm.hpp"

#include "controller/flight/flight_files.hpp"
#include "controller/flight/flight_history.hpp"
#include "controller/flight/flight_recorder.hpp"
#include "controller/flight/replay.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <vector>

// From the tick to the file and back through the tick: what is recorded replays bit for bit, and what is no record is refused with the reason.

namespace breakshot::control::flight {
namespace {

using test::all;
using test::make_joined;
using test::make_trajectory;
using test::Stand;
using test::test_config;
using ::testing::HasSubstr;
using ::testing::StartsWith;

namespace fs = std::filesystem;

FlightRecord round_trip(const FlightRecord& record) {
  auto back = decode(encode(record));
  EXPECT_TRUE(back) << (back ? "" : back.error());
  return back ? std::move(*back) : FlightRecord{};
}

/// A loop that is recorded, and somebody who asks it for strokes.
class Flight : public ::testing::Test {
 protected:
  void start(double by) {
    trajectories.push_back(make_trajectory(stand.status().setpoint.q, all(by), trajectories.size() + 1));
    history.remember(stand.started + 1, *trajectories.back());
    stand.start(*trajectories.back());
  }
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      stand.tick();
      if (i % 20 == 0) history.drain();
    }
    history.drain();
  }
  FlightRecord take() {
    auto record = history.take(false);
    EXPECT_TRUE(record) << "nothing was recorded";
    return record ? std::move(*record) : FlightRecord{};
  }
  /// A stroke that something in the way stops, after another one and some time.
  FlightRecord blocked_stroke() {
    run(3000);
    start(0.4);
    run(1000);
    start(-0.4);
    run(200);
    stand.drives.block(2);
    run(1000);
    return take();
  }

  std::unique_ptr<FlightTap> tap = std::make_unique<FlightTap>();
  Stand stand{test_config(), tap.get()};
  FlightHistory history{test_config(), *tap};
  std::vector<std::unique_ptr<motion::Trajectory>> trajectories;
};

// A hundred seconds of everything that can go wrong: every stop, refusal and recovery becomes a record, and every record replays bit for bit.
TEST(FlightStorm, EveryRecordReplaysBitForBit) {
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
  constexpr int kTicks = 60'000;
#else
  constexpr int kTicks = 100'000;
#endif
  const auto tap = std::make_unique<FlightTap>();
  FlightHistory history{test_config(), *tap};
  test::Storm storm{3, tap.get(), [&](std::uint64_t number, const motion::Trajectory& each) { history.remember(number, each); }};
  std::mt19937 random{3};
  int records = 0, ticks = 0;
  std::array<int, kTriggers> by_trigger{};
  storm.run(kTicks, [&](const Stand&, const JointCommand&) {
    if (++ticks % 20 != 0) return;
    history.drain();
    auto record = history.take(false);
    if (!record) return;
    ++records;
    ++by_trigger[static_cast<std::size_t>(record->trigger)];
    // Through the bytes of a file every time would take minutes; one in ten shows as much.
    if (random() % 10 == 0) record = round_trip(*record);
    const auto result = replay(*record);
    EXPECT_FALSE(result.difference) << "tick " << result.difference->tick << ": " << result.difference->what;
    EXPECT_EQ(result.ticks, record->ticks.size());
  });
  EXPECT_GT(records, kTicks / 5'000);
  EXPECT_GT(by_trigger[static_cast<std::size_t>(Trigger::kStop)], 0);
  EXPECT_GT(by_trigger[static_cast<std::size_t>(Trigger::kRefusal)], 0);
  EXPECT_EQ(history.lost(), 0U);
}

TEST_F(Flight, AStopIsRecordedWithTheTwoSecondsBeforeItAndTheHalfSecondAfterIt) {
  const FlightRecord record = blocked_stroke();
  EXPECT_EQ(record.trigger, Trigger::kStop);
  EXPECT_THAT(record.why, HasSubstr("the arm is not where it was told to be"));
  EXPECT_GE(record.trigger_tick - record.start.tick, 2000U);
  EXPECT_LE(record.trigger_tick - record.start.tick, 2000U + FlightTap::kKeyframeEvery);
  EXPECT_GE(record.ticks.back().tick - record.trigger_tick, 500U);
  EXPECT_EQ(record.trajectories.size(), 2U) << "both strokes lie in the time";

  const FlightRecord back = round_trip(record);
  EXPECT_EQ(encode(back), encode(record));
  std::vector<LoopEvent::Kind> events;
  const auto result = replay(back, [&](const LoopEvent& event) { events.push_back(event.kind); });
  EXPECT_FALSE(result.difference) << result.difference->what;
  EXPECT_THAT(events, ::testing::Contains(LoopEvent::Kind::kStopped)) << "the replay decides the same";
}

// Whether the record begins before, between or after a trajectory's coming and its taking over; at whatever offset, and with ticks skipped across the join.
TEST_F(Flight, AJoinReplaysBitForBit) {
  run(3000);
  for (int i = 0; i < 12; ++i) {
    start(i % 2 == 0 ? 0.4 : -0.4);
    run(20);
    trajectories.push_back(make_joined(*trajectories.back(), 600, all(i % 2 == 0 ? 0.1 : -0.1), trajectories.size() + 1));
    history.remember(stand.started + 1, *trajectories.back());
    stand.join(*trajectories.back(), {stand.started, 600});
    run(575);
    stand.tick({.skip = i});
    run(i % 3 == 0 ? 2000 - 595 : i % 3 == 1 ? 1500 : 40);  // the stop comes long after, or soon after; keyframes lie anywhere
    stand.request(LoopRequest::Kind::kStop);
    run(600);
    const FlightRecord record = take();
    bool joined = false;
    const auto result = replay(round_trip(record), [&](const LoopEvent& event) { joined = joined || event.joined; });
    EXPECT_FALSE(result.difference) << result.difference->tick << ": " << result.difference->what;
    EXPECT_TRUE(joined);
    EXPECT_EQ(encode(round_trip(record)), encode(record));
    stand.request(LoopRequest::Kind::kRecover);
    run(50);
  }
}

// A record that begins while a trajectory waits to take over.
TEST_F(Flight, ARecordMayBeginBetweenARequestAndItsJoin) {
  run(3000);
  trajectories.push_back(make_trajectory(stand.status().setpoint.q, all(0.4), 1, 4000));
  history.remember(stand.started + 1, *trajectories.back());
  stand.start(*trajectories.back());
  run(20);
  trajectories.push_back(make_joined(*trajectories[0], 3200, all(0.1), 2));
  history.remember(stand.started + 1, *trajectories.back());
  stand.join(*trajectories.back(), {stand.started, 3200});
  run(3300);
  stand.request(LoopRequest::Kind::kStop);
  run(600);
  const FlightRecord record = take();
  EXPECT_EQ(record.start.memory.next_number_, 2U);
  EXPECT_EQ(record.trajectories.size(), 2U);
  const auto result = replay(round_trip(record));
  EXPECT_FALSE(result.difference) << result.difference->tick << ": " << result.difference->what;

  FlightRecord without = round_trip(record);
  without.trajectories.erase(2);
  EXPECT_THAT(decode(encode(without)).error(), HasSubstr("no trajectory 2, which is to follow"));
  FlightRecord nowhere = round_trip(record);
  nowhere.start.memory.join_tick_ = -7;
  EXPECT_THAT(decode(encode(nowhere)).error(), HasSubstr("a trajectory to follow where none can"));
}

TEST_F(Flight, ReplayNamesTheFirstDifference) {
  FlightRecord record = blocked_stroke();
  record.ticks[1234].command.q[2] += 1e-15;
  record.ticks[1500].command.q[0] += 1.0;
  const auto result = replay(record);
  ASSERT_TRUE(result.difference);
  EXPECT_EQ(result.difference->tick, record.ticks[1234].tick);
  EXPECT_THAT(result.difference->what, StartsWith("command.q of joint 3: replayed "));
}

TEST_F(Flight, AnotherConfigurationIsADifference) {
  FlightRecord record = blocked_stroke();
  record.config.following.floor *= 2.0;
  EXPECT_TRUE(replay(round_trip(record)).difference);
}

TEST_F(Flight, WhatGoesWrongSoonAfterIsInTheSameRecordAndTheGravestNamesIt) {
  run(3000);
  start(0.4);
  run(100);
  start(0.1);  // refused: something moves
  run(50);
  stand.request(LoopRequest::Kind::kStop);
  run(600);
  const FlightRecord record = take();
  EXPECT_EQ(record.trigger, Trigger::kStop);
  EXPECT_FALSE(history.take(true)) << "one record, not two";
  EXPECT_FALSE(replay(round_trip(record)).difference);
}

TEST_F(Flight, SomebodyElsesReasonIsRecordedToo) {
  run(3000);
  history.note(Trigger::kRefusal, "stroke 7: unreachable");
  run(600);
  const FlightRecord record = take();
  EXPECT_EQ(record.trigger, Trigger::kRefusal);
  EXPECT_EQ(record.why, "stroke 7: unreachable");
  EXPECT_FALSE(replay(round_trip(record)).difference);
}

TEST_F(Flight, AfterAGapTheRecordBeginsBehindIt) {
  run(3000);
  for (int i = 0; i < 6000; ++i) stand.tick();  // nobody empties the tap
  run(100);
  EXPECT_GT(history.lost(), 0U);
  run(1000);
  stand.request(LoopRequest::Kind::kStop);
  run(600);
  const FlightRecord record = take();
  EXPECT_GT(record.start.tick, 9000U);
  EXPECT_FALSE(replay(round_trip(record)).difference);
}

TEST_F(Flight, AFileThatIsCutOffOrDamagedAnywhereIsRefusedWithTheReason) {
  const std::string whole = encode(blocked_stroke());
  const auto error_of = [](const std::string& bytes) {
    const auto record = decode(bytes);
    return record ? std::string{"no error"} : record.error();
  };
  EXPECT_EQ(error_of(whole), "no error");
  EXPECT_THAT(error_of("PNG"), HasSubstr("no flight record"));
  EXPECT_THAT(error_of(whole.substr(0, 20)), HasSubstr("cut off: 20 bytes"));
  EXPECT_THAT(error_of(whole + "x"), HasSubstr("1 bytes too many"));
  std::mt19937 random{1};
  for (int i = 0; i < 200; ++i) {
    const std::size_t at = 40 + random() % (whole.size() - 40);
    EXPECT_THAT(error_of(whole.substr(0, at)), HasSubstr("cut off")) << at;
    std::string flipped = whole;
    flipped[at] = static_cast<char>(flipped[at] ^ (1 << random() % 8));
    EXPECT_THAT(error_of(flipped), HasSubstr("damaged")) << at;
  }
  std::string newer = whole;
  newer[16] = 9;
  EXPECT_THAT(error_of(newer), HasSubstr("version 9; this program reads version 3"));
}

// A file with a right checksum may still be nonsense (or malice): reading and replaying it must end, in an error or in a difference, and touch nothing
// that is not there. ASan looks on.
TEST_F(Flight, NonsenseWithARightChecksumDoesNoHarm) {
  FlightRecord record = blocked_stroke();
  record.ticks.resize(300);
  const std::string whole = encode(record);
  constexpr std::size_t kHeader = 32;
  std::mt19937 random{2};
  int read = 0, refused = 0;
  for (int i = 0; i < 600; ++i) {
    std::string contents = whole.substr(kHeader);
    // Half of the changes where the loop's memory lies, which is what a replay trusts most.
    const std::size_t range = i % 2 == 0 ? contents.size() : std::size_t{10'000};
    for (int n = 0; n < 3; ++n) contents[random() % range] = static_cast<char>(random());
    auto nonsense = decode(with_checksum(contents));
    if (nonsense) {
      ++read;
      replay(*nonsense);
    } else {
      ++refused;
    }
  }
  EXPECT_GT(read, 30);
  EXPECT_GT(refused, 30);
}

class FlightFolder : public Flight {
 protected:
  void SetUp() override { fs::remove_all(root_); }
  void TearDown() override { fs::remove_all(root_); }
  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator{folder_}) names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }

  fs::path root_ = fs::path{BREAKSHOT_BINARY_DIR} / "tests" / ("flight_test." + std::to_string(getpid()));
  fs::path folder_ = root_ / "made" / "here";
};

TEST_F(FlightFolder, KeepsTheNewestFilesOfEachTrigger) {
  FlightRecord record = blocked_stroke();
  record.written_utc_ns = 1'700'000'000'123'000'000;
  fs::create_directories(folder_);
  std::ofstream{folder_ / "flight-20200101T000000.000Z-stop.flight.unfinished"} << "left behind by a crash";
  std::ofstream{folder_ / "notes.txt"} << "not ours";
  for (int i = 0; i < 5; ++i) {
    record.trigger = i == 0 ? Trigger::kFault : Trigger::kStop;
    const auto stored = store(folder_, record, 3);
    ASSERT_TRUE(stored) << stored.error();
    record.written_utc_ns += 1'000'000'000;
  }
  EXPECT_THAT(names(),
              ::testing::ElementsAre("flight-20231114T221320.123Z-fault.flight", "flight-20231114T221322.123Z-stop.flight",
                                     "flight-20231114T221323.123Z-stop.flight", "flight-20231114T221324.123Z-stop.flight", "notes.txt"))
      << "stops do not drive out the fault";
  const auto back = load(folder_ / names()[1]);
  ASSERT_TRUE(back) << back.error();
  EXPECT_FALSE(replay(*back).difference);
}

TEST_F(FlightFolder, AFolderThatCannotBeIsSaid) {
  fs::create_directories(root_);
  std::ofstream{root_ / "made"} << "a file stands in the way";
  const auto stored = store(folder_, blocked_stroke(), 3);
  ASSERT_FALSE(stored);
  EXPECT_THAT(stored.error(), HasSubstr(folder_.string()));
  EXPECT_THAT(load(folder_ / "none.flight").error(), HasSubstr("cannot be read"));
}

TEST_F(FlightFolder, TheRecorderWritesWhatIsAskedForWhenItEnds) {
  std::vector<std::string> told;
  {
    FlightRecorder recorder{{folder_, 3}, test_config(), *tap, [&](const FlightRecorder::Stored& stored, const std::string& why) {
                              told.push_back(stored ? why : stored.error());
                            }};
    for (int i = 0; i < 300; ++i) stand.tick();
    stand.request(LoopRequest::Kind::kStop);
    stand.tick();
  }
  ASSERT_EQ(told.size(), 1U);
  EXPECT_THAT(told[0], HasSubstr("a stop was asked for"));
  const auto record = load(folder_ / names()[0]);
  ASSERT_TRUE(record) << record.error();
  EXPECT_EQ(replay(*record).ticks, 301U);
}

}  // namespace
}  // namespace breakshot::control::flight
