#include "common/dds/endpoint.hpp"

#include <spdlog/spdlog.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include <chrono>
#include <stdexcept>
#include <thread>

namespace breakshot::dds {

namespace efd = eprosima::fastdds::dds;

namespace {

/// Finds or makes the topic. Several endpoints of one participant may share it.
efd::Topic* find_topic(Participant& participant, const std::string& name, efd::TopicDataType* raw_type) {
  efd::TypeSupport type{raw_type};
  // Type information of fastddsgen 2.3 makes Cyclone DDS reject the endpoint (reference/dds-mes-systemd.md 2.1).
  type->auto_fill_type_information(false);
  type->auto_fill_type_object(false);
  if (auto* known = participant.handle()->lookup_topicdescription(name); known != nullptr) {
    if (known->get_type_name() != type.get_type_name())
      throw std::runtime_error("DDS topic " + name + " is already in use with another type");
    return dynamic_cast<efd::Topic*>(known);
  }
  if (type.register_type(participant.handle()) != eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
    throw std::runtime_error("DDS topic " + name + ": cannot register type " + type.get_type_name());
  }
  auto* topic = participant.handle()->create_topic(name, type.get_type_name(), efd::TOPIC_QOS_DEFAULT);
  if (topic == nullptr) throw std::runtime_error("DDS topic " + name + ": cannot be created");
  return topic;
}

/// Writer and reader QoS have the same members for all that a profile sets.
template <typename Qos>
void apply(Profile profile, Qos& qos) {
  qos.data_sharing().off();
  qos.durability().kind = efd::VOLATILE_DURABILITY_QOS;
  qos.reliability().kind = efd::BEST_EFFORT_RELIABILITY_QOS;
  qos.history().kind = efd::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = 1;
  qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  switch (profile) {
    case Profile::kStream: break;
    case Profile::kFrame:
      qos.history().depth = 3;
      qos.data_sharing().automatic();
      qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_MEMORY_MODE;
      break;
    case Profile::kEvent: qos.history().depth = 64; break;
    case Profile::kRequest:
      qos.reliability().kind = efd::RELIABLE_RELIABILITY_QOS;
      qos.history().depth = 64;
      break;
    case Profile::kRos:
      qos.reliability().kind = efd::RELIABLE_RELIABILITY_QOS;
      qos.history().depth = 5;
      break;
    case Profile::kLatched:
      qos.reliability().kind = efd::RELIABLE_RELIABILITY_QOS;
      qos.durability().kind = efd::TRANSIENT_LOCAL_DURABILITY_QOS;
      // The default of 10 instances makes the eleventh key fail for ever (reference/dds-mes-systemd.md 1.3).
      qos.resource_limits().max_instances = 512;
      qos.resource_limits().max_samples_per_instance = 4;
      qos.resource_limits().max_samples = 2048;
      break;
  }
}

}  // namespace

WriterBase::WriterBase(Participant& participant, const std::string& topic, Profile profile, efd::TopicDataType* type)
    : participant_{participant} {
  efd::DataWriterQos qos = efd::DATAWRITER_QOS_DEFAULT;
  apply(profile, qos);
  qos.reliability().max_blocking_time = eprosima::fastrtps::Duration_t{0, 100'000'000};
  qos.publish_mode().kind = efd::SYNCHRONOUS_PUBLISH_MODE;
  writer_ = participant.publisher()->create_datawriter(find_topic(participant, topic, type), qos);
  if (writer_ == nullptr) throw std::runtime_error("DDS topic " + topic + ": cannot create a writer");
}

WriterBase::~WriterBase() { participant_.publisher()->delete_datawriter(writer_); }

int WriterBase::matched() const noexcept {
  efd::PublicationMatchedStatus status;
  writer_->get_publication_matched_status(status);
  return status.current_count;
}

bool WriterBase::write_wire(void* sample) noexcept {
  try {
    return writer_->write(sample);
  } catch (const std::exception& error) {
    // Fast CDR throws on a string or sequence beyond its bound; encode() keeps to the bounds, so this is a bug worth a line and no crash.
    spdlog::error("code=dds_write topic={} error={}", writer_->get_topic()->get_name(), error.what());
    return false;
  }
}

class ReaderBase::Listener : public efd::DataReaderListener {
 public:
  explicit Listener(ReaderBase& owner) : owner_{owner} {}
  void on_data_available(efd::DataReader* /*reader*/) override { owner_.notify(); }

 private:
  ReaderBase& owner_;
};

ReaderBase::ReaderBase(Participant& participant, std::string topic, Profile profile, efd::TopicDataType* type)
    : participant_{participant}, topic_{std::move(topic)}, listener_{std::make_unique<Listener>(*this)} {
  efd::DataReaderQos qos = efd::DATAREADER_QOS_DEFAULT;
  apply(profile, qos);
  // Created disabled (Participant says so to its subscriber): on_data() is not to be called before the subclass is complete.
  reader_ = participant.subscriber()->create_datareader(find_topic(participant, topic_, type), qos, listener_.get());
  if (reader_ == nullptr) throw std::runtime_error("DDS topic " + topic_ + ": cannot create a reader");
}

ReaderBase::~ReaderBase() { participant_.subscriber()->delete_datareader(reader_); }

void ReaderBase::enable() { reader_->enable(); }

void ReaderBase::disable() noexcept {
  closed_ = true;
  while (pending_ != 0) std::this_thread::sleep_for(std::chrono::microseconds{100});
}

// DDS announces data from several threads, some of them holding the reader's own lock, so a lock here could deadlock against it. Instead the first
// thread to come drains for all; whoever comes meanwhile only leaves word that it is to look once more.
void ReaderBase::notify() noexcept {
  if (pending_.fetch_add(1) != 0) return;
  int seen = 0;
  do {
    seen = pending_;
    if (!closed_) on_data();
  } while (!pending_.compare_exchange_strong(seen, 0));
}

int ReaderBase::matched() const noexcept {
  efd::SubscriptionMatchedStatus status;
  reader_->get_subscription_matched_status(status);
  return status.current_count;
}

bool ReaderBase::take_wire(void* sample) noexcept {
  efd::SampleInfo info;
  while (reader_->take_next_sample(sample, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
    if (info.valid_data) return true;
  }
  return false;
}

void ReaderBase::reject(const Invalid& why) noexcept {
  const auto count = rejected_.fetch_add(1, std::memory_order_relaxed) + 1;
  // The first ten, then every thousandth: a peer that sends rubbish at 1 kHz must not fill the disk.
  if (count <= 10 || count % 1000 == 0) spdlog::warn("code=rejected_sample topic={} count={} why=\"{}\"", topic_, count, why);
}

}  // namespace breakshot::dds
