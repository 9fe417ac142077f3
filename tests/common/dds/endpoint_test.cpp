#include "common/dds/endpoint.hpp"
#include "common/dds/cell_topics.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <thread>

namespace breakshot::dds {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// A domain of this test's own, so that tests side by side do not hear each other.
int own_domain() { return 100 + static_cast<int>(getpid() % 100); }

/// Writes until the reader has something or ten seconds are over: discovery takes its time.
template <typename T>
bool deliver(Writer<T>& writer, Reader<T>& reader, const T& value, T& got) {
  const auto deadline = std::chrono::steady_clock::now() + seconds{10};
  while (std::chrono::steady_clock::now() < deadline) {
    writer.write(value);
    if (reader.take(got, milliseconds{50})) return true;
  }
  return false;
}

TEST(Endpoints, CarryAValueBetweenParticipants) {
  Participant here{own_domain(), "here"};
  Participant there{own_domain(), "there"};
  Writer<StrokeRequest> writer{here};
  Reader<StrokeRequest> reader{there};
  StrokeRequest request;
  request.id = 42;
  request.kind = StrokeKind::kPush;
  request.length = 0.05;
  StrokeRequest got;
  ASSERT_TRUE(deliver(writer, reader, request, got));
  EXPECT_EQ(got.id, 42U);
  EXPECT_EQ(got.kind, StrokeKind::kPush);
  EXPECT_EQ(got.length, 0.05);
}

TEST(Endpoints, CarryAWholeImage) {
  Participant here{own_domain(), "here"};
  Participant there{own_domain(), "there"};
  Writer<ColorFrame> writer{here};
  Reader<ColorFrame> reader{there};
  ColorFrame frame{9, time_from_ns(77), 1280, 720, {}};
  frame.rgb.resize(3UL * 1280 * 720);
  for (std::size_t i = 0; i < frame.rgb.size(); ++i) frame.rgb[i] = static_cast<std::uint8_t>(i * 31);
  ColorFrame got;
  ASSERT_TRUE(deliver(writer, reader, frame, got));
  EXPECT_EQ(got.seq, 9U);
  EXPECT_EQ(got.exposed, frame.exposed);
  EXPECT_EQ(got.rgb, frame.rgb);
}

TEST(Endpoints, GiveALateJoinerWhatIsLatched) {
  Participant here{own_domain(), "here"};
  Writer<CameraModel> writer{here};
  CameraModel camera;
  camera.fx = camera.fy = 914.0;
  writer.write(camera);
  Participant there{own_domain(), "there"};
  Reader<CameraModel> reader{there};
  CameraModel got;
  ASSERT_TRUE(reader.take(got, seconds{10}));
  EXPECT_EQ(got.fx, 914.0);
}

TEST(Endpoints, CountWhatTheyRefuseAndGoOn) {
  Participant here{own_domain(), "here"};
  Participant there{own_domain(), "there"};
  Writer<JointState> writer{here};
  Reader<JointState> reader{there};
  JointState state;
  state.q = state.qd = state.tau = JointVector::Zero(6);
  JointState got;
  ASSERT_TRUE(deliver(writer, reader, state, got));
  state.q[0] = std::numeric_limits<double>::quiet_NaN();
  while (reader.rejected() == 0) {
    writer.write(state);
    EXPECT_FALSE(reader.take(got, milliseconds{50}));
  }
  state.q[0] = 1.0;
  ASSERT_TRUE(deliver(writer, reader, state, got));
  EXPECT_EQ(got.q[0], 1.0);
}

TEST(Endpoints, MayEndWhileSamplesPourIn) {
  Participant here{own_domain(), "here"};
  Participant there{own_domain(), "there"};
  Writer<Health> writer{here};
  std::atomic<bool> done{false};
  std::thread source{[&] {
    while (!done) writer.write(Health{});
  }};
  for (int i = 0; i < 20; ++i) {
    auto alive = std::make_shared<std::atomic<bool>>(true);
    {
      Subscription<Health> subscription{there, [alive](Health&&) { EXPECT_TRUE(alive->load()); }};
      std::this_thread::yield();
    }
    *alive = false;
  }
  done = true;
  source.join();
}

TEST(Endpoints, WakeEndsAWait) {
  Participant here{own_domain(), "here"};
  Reader<Scene> reader{here};
  std::thread waker{[&] { reader.wake(); }};
  Scene scene;
  EXPECT_FALSE(reader.take(scene, seconds{60}));
  waker.join();
}

}  // namespace
}  // namespace breakshot::dds
