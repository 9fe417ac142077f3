#include "common/dds/participant.hpp"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>

#include <cstdlib>
#include <stdexcept>

namespace breakshot::dds {

namespace efd = eprosima::fastdds::dds;

namespace {

// A colour frame that falls back to UDP is 43 datagrams; the kernel's default of 208 KiB would lose most of them.
constexpr std::uint32_t kSocketBufferBytes = 4U << 20U;

}  // namespace

Participant::Participant(int domain, const std::string& name, const std::vector<std::string>& interfaces) {
  // Else a DEFAULT_FASTRTPS_PROFILES.xml in whatever directory the process started in would change the QoS.
  setenv("SKIP_DEFAULT_XML", "1", 1);

  efd::DomainParticipantQos qos = efd::PARTICIPANT_QOS_DEFAULT;
  qos.name(name);
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = interfaces;
  udp->sendBufferSize = kSocketBufferBytes;
  udp->receiveBufferSize = kSocketBufferBytes;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  // A peer that is killed is forgotten after this; one that starts is found at its first announcement.
  qos.wire_protocol().builtin.discovery_config.leaseDuration = eprosima::fastrtps::Duration_t{5, 0};
  qos.wire_protocol().builtin.discovery_config.leaseDuration_announcementperiod = eprosima::fastrtps::Duration_t{1, 0};
  qos.wire_protocol().builtin.discovery_config.initial_announcements.count = 10;
  qos.wire_protocol().builtin.discovery_config.initial_announcements.period = eprosima::fastrtps::Duration_t{0, 50'000'000};

  auto* factory = efd::DomainParticipantFactory::get_instance();
  participant_ = factory->create_participant(static_cast<efd::DomainId_t>(domain), qos);
  if (participant_ == nullptr) {
    throw std::runtime_error("DDS domain " + std::to_string(domain) +
                             ": cannot create a participant; check that the domain is 0 to 232, that the interface address exists and that "
                             "its UDP ports are free");
  }
  publisher_ = participant_->create_publisher(efd::PUBLISHER_QOS_DEFAULT);
  efd::SubscriberQos subscriber_qos = efd::SUBSCRIBER_QOS_DEFAULT;
  subscriber_qos.entity_factory().autoenable_created_entities = false;  // readers enable themselves when they are complete
  subscriber_ = participant_->create_subscriber(subscriber_qos);
  if (publisher_ == nullptr || subscriber_ == nullptr) throw std::runtime_error("DDS: cannot create publisher and subscriber");
}

Participant::~Participant() {
  participant_->delete_contained_entities();
  efd::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

}  // namespace breakshot::dds
