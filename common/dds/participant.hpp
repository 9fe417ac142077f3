#pragma once

#include <memory>
#include <string>
#include <vector>

namespace eprosima::fastdds::dds {
class DomainParticipant;
class Publisher;
class Subscriber;
}  // namespace eprosima::fastdds::dds

namespace breakshot::dds {

/// One process's seat in a DDS domain.
///
/// UDP only, bound to the given interface addresses (the inner cell never leaves the machine): the shared-memory transport takes a lock that a
/// killed peer would leave held (reference/dds-mes-systemd.md 1.2); big images go by data-sharing, which each topic chooses for itself. No XML
/// profile is read. Create it before any thread becomes real-time: DDS threads inherit the creator's scheduling.
class Participant {
 public:
  /// @param name        seen by tools, e.g. "breakshot-controller"
  /// @param interfaces  IPv4 addresses to bind to; empty: all
  /// @throws std::runtime_error when the domain cannot be joined, with what to check
  Participant(int domain, const std::string& name, const std::vector<std::string>& interfaces = {"127.0.0.1"});
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;
  Participant(Participant&&) = delete;
  Participant& operator=(Participant&&) = delete;

  eprosima::fastdds::dds::DomainParticipant* handle() const noexcept { return participant_; }
  eprosima::fastdds::dds::Publisher* publisher() const noexcept { return publisher_; }
  eprosima::fastdds::dds::Subscriber* subscriber() const noexcept { return subscriber_; }

 private:
  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
  eprosima::fastdds::dds::Publisher* publisher_ = nullptr;
  eprosima::fastdds::dds::Subscriber* subscriber_ = nullptr;
};

}  // namespace breakshot::dds
