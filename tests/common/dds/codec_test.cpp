#include "common/dds/cell_topics.hpp"

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastdds/rtps/common/SerializedPayload.h>
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <random>

namespace breakshot::dds {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Over the wire and back, through the generated serialiser.
template <typename T>
Result<T, Invalid> travel(const T& value) {
  auto sent = std::make_unique<typename Topic<T>::Wire>();
  auto received = std::make_unique<typename Topic<T>::Wire>();
  Topic<T>::encode(value, *sent);
  typename Topic<T>::WireSupport support;
  eprosima::fastrtps::rtps::SerializedPayload_t payload{static_cast<std::uint32_t>(support.getSerializedSizeProvider(sent.get())())};
  EXPECT_TRUE(support.serialize(sent.get(), &payload));
  EXPECT_TRUE(support.deserialize(&payload, received.get()));
  return Topic<T>::decode(*received);
}

Scene two_touching_discs() {
  Scene scene;
  scene.seq = 7;
  scene.frame_seq = 5;
  scene.exposed = time_from_ns(123'456'789);
  scene.max_speed = kInfinity;
  scene.discs.resize(2);
  scene.discs[0] = {1, {-0.03, 0.1}, Matrix2::Identity() * 1e-8, {0.1, 0.0}, 0.03, 1e-4, 2, true};
  scene.discs[1] = {4, {0.03, 0.1}, Matrix2::Identity() * 2e-8, {0.0, 0.0}, 0.03, 1e-4, 3, false};
  scene.contacts.push_back({0, 1, -1e-4, 0.97, {0.0, 0.07}, {0.0, 1.0}, 0.02});
  scene.foreign.push_back({ForeignObject::Kind::kOffTable, {0.1, -0.2}, 0.03, 0.032});
  scene.at_rest = true;
  scene.age = std::chrono::milliseconds{70};
  return scene;
}

TEST(SceneCodec, KeepsEveryField) {
  const Scene sent = two_touching_discs();
  const auto got = travel(sent);
  ASSERT_TRUE(got) << got.error();
  EXPECT_EQ(got->seq, sent.seq);
  EXPECT_EQ(got->frame_seq, sent.frame_seq);
  EXPECT_EQ(got->exposed, sent.exposed);
  EXPECT_EQ(got->max_speed, kInfinity);
  ASSERT_EQ(got->discs.size(), 2U);
  EXPECT_EQ(got->discs[1].id, 4U);
  EXPECT_EQ(got->discs[1].p_WD, sent.discs[1].p_WD);
  EXPECT_EQ(got->discs[1].covariance, sent.discs[1].covariance);
  EXPECT_EQ(got->discs[0].v_WD_W, sent.discs[0].v_WD_W);
  EXPECT_FALSE(got->discs[1].complete);
  ASSERT_EQ(got->contacts.size(), 1U);
  EXPECT_EQ(got->contacts[0].push_direction_W, sent.contacts[0].push_direction_W);
  EXPECT_EQ(got->contacts[0].contour_length, sent.contacts[0].contour_length);
  ASSERT_EQ(got->foreign.size(), 1U);
  EXPECT_EQ(got->foreign[0].kind, sent.foreign[0].kind);
  EXPECT_EQ(got->foreign[0].p_W, sent.foreign[0].p_W);
  EXPECT_EQ(got->foreign[0].extent, sent.foreign[0].extent);
  EXPECT_EQ(got->foreign[0].height, sent.foreign[0].height);
  EXPECT_TRUE(got->at_rest);
  EXPECT_EQ(got->age, sent.age);
}

TEST(SceneCodec, RefusesWhatNoCameraCanSee) {
  const auto refused = [](auto&& spoil) {
    Scene scene = two_touching_discs();
    spoil(scene);
    const auto got = travel(scene);
    return !got && !got.error().empty();
  };
  EXPECT_TRUE(refused([](Scene& s) { s.discs[0].p_WD.x() = kNaN; }));
  EXPECT_TRUE(refused([](Scene& s) { s.discs[0].p_WD.x() = 1e9; }));
  EXPECT_TRUE(refused([](Scene& s) { s.discs[1].radius = 0.0; }));
  EXPECT_TRUE(refused([](Scene& s) { s.discs[1].radius = -0.03; }));
  EXPECT_TRUE(refused([](Scene& s) { s.contacts[0].b = 2; }));
  EXPECT_TRUE(refused([](Scene& s) { std::swap(s.contacts[0].a, s.contacts[0].b); }));
  EXPECT_TRUE(refused([](Scene& s) { s.contacts[0].p_touch = 1.5; }));
  EXPECT_TRUE(refused([](Scene& s) { s.foreign[0].kind = static_cast<ForeignObject::Kind>(3); }));
  EXPECT_TRUE(refused([](Scene& s) { s.foreign[0].extent = -0.01; }));
  EXPECT_TRUE(refused([](Scene& s) { s.quality = static_cast<SceneQuality>(9); }));
}

TEST(SceneCodec, CutsWhatIsTooLongInsteadOfThrowing) {
  Scene scene = two_touching_discs();
  scene.discs.assign(kMaxSceneDiscs + 10, scene.discs[0]);
  scene.foreign.assign(kMaxSceneForeign + 10, scene.foreign[0]);
  scene.text.assign(1000, 'x');
  const auto got = travel(scene);
  ASSERT_TRUE(got) << got.error();
  EXPECT_EQ(got->discs.size(), kMaxSceneDiscs);
  EXPECT_EQ(got->foreign.size(), kMaxSceneForeign);
  EXPECT_EQ(got->text.size(), 255U);
}

TEST(JointCodec, KeepsTheNumberOfJointsAndRefusesRubbish) {
  JointState state;
  state.seq = 3;
  state.stamp = time_from_ns(-5);
  state.q = JointVector::LinSpaced(6, -1.0, 1.0);
  state.qd = state.q;
  state.tau = state.q;
  state.braked = true;
  const auto got = travel(state);
  ASSERT_TRUE(got) << got.error();
  EXPECT_EQ(got->q, state.q);
  EXPECT_EQ(got->stamp, state.stamp);
  EXPECT_TRUE(got->braked);

  JointCommand command;
  command.q = command.qd = command.qdd = JointVector::Zero(6);
  ASSERT_TRUE(travel(command));
  command.qd[2] = kNaN;
  EXPECT_FALSE(travel(command));
  command.qd[2] = 1e9;
  EXPECT_FALSE(travel(command));
}

TEST(TaskCodec, CarriesGapsThatAreInfiniteOrUnknown) {
  TaskStatus status;
  status.smallest_gap = kInfinity;
  EXPECT_EQ(travel(status)->smallest_gap, kInfinity);
  Plan plan;
  plan.stroke.id = 1;
  plan.predicted_gap = kNaN;
  plan.why = "nearest contact";
  plan.predicted_p_WD = {{0.1, 0.2}, {0.3, 0.4}};
  plan.candidates.push_back({plan.stroke, 1.5, 0.5, 0.1});
  const auto got = travel(plan);
  ASSERT_TRUE(got) << got.error();
  EXPECT_TRUE(std::isnan(got->predicted_gap));
  EXPECT_EQ(got->predicted_p_WD, plan.predicted_p_WD);
  EXPECT_EQ(got->candidates.size(), 1U);
}

TEST(HealthCodec, KeepsTheTailsAndWhoseTheOverrunsAreAndRefusesRubbish) {
  Health sent;
  sent.process = "controller";
  sent.overruns = 9;
  sent.overruns_ours = 2;
  sent.overruns_hosts = 7;
  sent.wakeup = {5.0, 30.0, 60.0, 120.0, 4000.0};
  sent.compute = {1.0, 2.0, 20.0, 40.0, 200.0};
  const auto got = travel(sent);
  ASSERT_TRUE(got) << got.error();
  EXPECT_EQ(got->overruns, 9U);
  EXPECT_EQ(got->overruns_ours, 2U);
  EXPECT_EQ(got->overruns_hosts, 7U);
  const auto list = [](const LoopTail& t) { return std::array{t.p50_us, t.p99_us, t.p999_us, t.p9999_us, t.max_us}; };
  EXPECT_EQ(list(got->wakeup), list(sent.wakeup));
  EXPECT_EQ(list(got->compute), list(sent.compute));
  for (double LoopTail::*const field : {&LoopTail::p50_us, &LoopTail::p99_us, &LoopTail::p999_us, &LoopTail::p9999_us, &LoopTail::max_us}) {
    for (const double rubbish : {kNaN, kInfinity, -1.0}) {
      Health wrong = sent;
      wrong.wakeup.*field = rubbish;
      EXPECT_FALSE(travel(wrong)) << rubbish;
      wrong = sent;
      wrong.compute.*field = rubbish;
      EXPECT_FALSE(travel(wrong)) << rubbish;
    }
  }
}

TEST(CameraCodec, RefusesAPoseThatIsNotRigid) {
  CameraModel camera;
  camera.fx = camera.fy = 900;
  ASSERT_TRUE(travel(camera));
  camera.X_WC.linear() *= 2.0;
  EXPECT_FALSE(travel(camera));
}

/// Whatever bytes a hostile peer sends: either a checked value or an error, never a crash (run it under ASan and UBSan too).
template <typename T>
void survives_random_bytes(std::mt19937& random, std::uint32_t size, int cases) {
  typename Topic<T>::WireSupport support;
  auto wire = std::make_unique<typename Topic<T>::Wire>();
  int accepted = 0;
  for (int i = 0; i < cases; ++i) {
    eprosima::fastrtps::rtps::SerializedPayload_t payload{size};
    payload.length = std::uniform_int_distribution<std::uint32_t>{4, size}(random);
    // Half of the samples are random throughout, half are zeros with a few flipped bytes: those get past the first checks.
    const bool noise = i % 2 == 0;
    for (std::uint32_t b = 0; b < size; ++b) payload.data[b] = noise || random() % 16 == 0 ? static_cast<unsigned char>(random()) : 0;
    payload.data[0] = 0;
    payload.data[1] = static_cast<unsigned char>(random() % 2);
    if (support.deserialize(&payload, wire.get()) && Topic<T>::decode(*wire)) ++accepted;
  }
  EXPECT_LT(accepted, cases);
}

TEST(EveryCodec, SurvivesRandomBytes) {
  std::mt19937 random{1};
  constexpr int kCases = 3000;
  survives_random_bytes<JointState>(random, 256, kCases);
  survives_random_bytes<JointCommand>(random, 256, kCases);
  survives_random_bytes<Scene>(random, 1024, kCases);
  survives_random_bytes<StrokeRequest>(random, 128, kCases);
  survives_random_bytes<StrokeStatus>(random, 128, kCases);
  survives_random_bytes<TaskRequest>(random, 128, kCases);
  survives_random_bytes<TaskStatus>(random, 256, kCases);
  survives_random_bytes<Plan>(random, 1024, kCases);
  survives_random_bytes<Outcome>(random, 128, kCases);
  survives_random_bytes<Health>(random, 256, kCases);
  survives_random_bytes<SimControl>(random, 512, kCases);
  survives_random_bytes<SimTruth>(random, 512, kCases);
  survives_random_bytes<CameraModel>(random, 256, kCases);
}

}  // namespace
}  // namespace breakshot::dds
