#include "mes_gateway/protocol/mes_topics.hpp"

#include <fastdds/rtps/common/SerializedPayload.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace breakshot::dds {
namespace {

template <typename T>
Result<T, Invalid> travel(const T& value) {
  typename Topic<T>::Wire sent;
  typename Topic<T>::Wire received;
  Topic<T>::encode(value, sent);
  typename Topic<T>::WireSupport support;
  eprosima::fastrtps::rtps::SerializedPayload_t payload{static_cast<std::uint32_t>(support.getSerializedSizeProvider(&sent)())};
  EXPECT_TRUE(support.serialize(&sent, &payload));
  EXPECT_TRUE(support.deserialize(&payload, &received));
  return Topic<T>::decode(received);
}

TEST(MesTopics, CarryACommandWithAbsurdNumbersToTheDesk) {
  mes::Command command;
  command.header.robot_id = 1;
  command.verb = static_cast<mes::Verb>(77);
  command.spec.min_gap = std::numeric_limits<double>::quiet_NaN();
  command.operator_id.assign(500, 'o');
  const auto got = travel(command);
  ASSERT_TRUE(got);
  EXPECT_EQ(static_cast<unsigned>(got->verb), 77U);
  EXPECT_TRUE(std::isnan(got->spec.min_gap));
  EXPECT_EQ(got->operator_id.size(), 64U);
}

TEST(MesTopics, KeepAJobState) {
  mes::JobState job;
  job.order_id = mes::random_id();
  job.phase = mes::JobPhase::kRunning;
  job.progress = 0.5;
  job.discs_seen = 6;
  job.text = "two contacts left";
  const auto got = travel(job);
  ASSERT_TRUE(got) << got.error();
  EXPECT_EQ(got->order_id, job.order_id);
  EXPECT_EQ(got->phase, mes::JobPhase::kRunning);
  EXPECT_TRUE(std::isinf(got->min_gap));
  EXPECT_EQ(got->text, job.text);
}

template <typename T>
void survives_random_bytes(std::mt19937& random) {
  typename Topic<T>::WireSupport support;
  typename Topic<T>::Wire wire;
  constexpr std::uint32_t kSize = 400;
  for (int i = 0; i < 3000; ++i) {
    eprosima::fastrtps::rtps::SerializedPayload_t payload{kSize};
    payload.length = std::uniform_int_distribution<std::uint32_t>{4, kSize}(random);
    for (std::uint32_t b = 0; b < kSize; ++b) payload.data[b] = i % 2 == 0 || random() % 16 == 0 ? static_cast<unsigned char>(random()) : 0;
    payload.data[0] = 0;
    payload.data[1] = static_cast<unsigned char>(random() % 2);
    if (support.deserialize(&payload, &wire)) {
      const auto decoded = Topic<T>::decode(wire);
      EXPECT_TRUE(decoded || !decoded.error().empty());
    }
  }
}

TEST(MesTopics, SurviveRandomBytes) {
  std::mt19937 random{1};
  survives_random_bytes<mes::Command>(random);
  survives_random_bytes<mes::Ack>(random);
  survives_random_bytes<mes::JobState>(random);
  survives_random_bytes<mes::RobotStatus>(random);
  survives_random_bytes<mes::Alarm>(random);
  survives_random_bytes<mes::Heartbeat>(random);
}

}  // namespace
}  // namespace breakshot::dds
