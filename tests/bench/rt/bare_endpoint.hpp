#pragma once

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

namespace breakshot::bench {

namespace efd = eprosima::fastdds::dds;

/// One writer and one reader as Fast DDS's examples make them, with no code of the cell in between: the yardstick for common/dds. Transport (UDP on
/// 127.0.0.1) and QoS are those of cell/joint_command and cell/joint_state: best effort, volatile, keep last 1, no data-sharing, synchronous.
template <typename Sent, typename SentSupport, typename Received, typename ReceivedSupport>
class BareEndpoint {
 public:
  /// @param receive  called on a DDS thread
  BareEndpoint(int domain, const std::string& send_on, const std::string& receive_on, std::function<void(const Received&)> receive)
      : listener_{std::move(receive)} {
    efd::DomainParticipantQos qos = efd::PARTICIPANT_QOS_DEFAULT;
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList = {"127.0.0.1"};
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    participant_ = efd::DomainParticipantFactory::get_instance()->create_participant(static_cast<efd::DomainId_t>(domain), qos);
    if (participant_ == nullptr) throw std::runtime_error("bare Fast DDS: no participant in domain " + std::to_string(domain));
    efd::DataWriterQos writer_qos = efd::DATAWRITER_QOS_DEFAULT;
    set(writer_qos);
    writer_qos.publish_mode().kind = efd::SYNCHRONOUS_PUBLISH_MODE;
    writer_ = participant_->create_publisher(efd::PUBLISHER_QOS_DEFAULT)->create_datawriter(topic(send_on, new SentSupport), writer_qos);
    efd::DataReaderQos reader_qos = efd::DATAREADER_QOS_DEFAULT;
    set(reader_qos);
    reader_ = participant_->create_subscriber(efd::SUBSCRIBER_QOS_DEFAULT)
                  ->create_datareader(topic(receive_on, new ReceivedSupport), reader_qos, &listener_);
    if (writer_ == nullptr || reader_ == nullptr) throw std::runtime_error("bare Fast DDS: no writer or reader");
  }
  ~BareEndpoint() {
    participant_->delete_contained_entities();
    efd::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  BareEndpoint(const BareEndpoint&) = delete;
  BareEndpoint& operator=(const BareEndpoint&) = delete;
  BareEndpoint(BareEndpoint&&) = delete;
  BareEndpoint& operator=(BareEndpoint&&) = delete;

  void send(Sent& sample) { writer_->write(&sample); }

 private:
  class Listener : public efd::DataReaderListener {
   public:
    explicit Listener(std::function<void(const Received&)> receive) : receive_{std::move(receive)} {}
    void on_data_available(efd::DataReader* reader) override {
      efd::SampleInfo info;
      while (reader->take_next_sample(&sample_, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
        if (info.valid_data) receive_(sample_);
      }
    }

   private:
    std::function<void(const Received&)> receive_;
    Received sample_;
  };

  template <typename Qos>
  static void set(Qos& qos) {
    qos.data_sharing().off();
    qos.durability().kind = efd::VOLATILE_DURABILITY_QOS;
    qos.reliability().kind = efd::BEST_EFFORT_RELIABILITY_QOS;
    qos.history().kind = efd::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 1;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  }

  efd::Topic* topic(const std::string& name, efd::TopicDataType* raw_type) {
    efd::TypeSupport type{raw_type};
    type->auto_fill_type_information(false);
    type->auto_fill_type_object(false);
    type.register_type(participant_);
    return participant_->create_topic(name, type.get_type_name(), efd::TOPIC_QOS_DEFAULT);
  }

  Listener listener_;
  efd::DomainParticipant* participant_ = nullptr;
  efd::DataWriter* writer_ = nullptr;
  efd::DataReader* reader_ = nullptr;
};

}  // namespace breakshot::bench
