#pragma once

#include "common/result.hpp"

#include <string>

namespace breakshot::dds {

/// How a topic travels. One profile per kind of data, so that both ends always agree (docs/topics.md gives the reasons).
enum class Profile {
  kStream,   ///< best effort, newest sample only: states, commands, scenes. Freshness is judged by seq and stamp, never by DDS
  kFrame,    ///< best effort, data-sharing: images of fixed size
  kEvent,    ///< best effort, deep queue: many writers, loss is harmless (health)
  kRequest,  ///< reliable, volatile: requests and their status. Volatile, so a restarted process is never handed an old command
  kRos,      ///< reliable, volatile, short queue: what ROS 2 nodes expect by default
  kLatched,  ///< reliable, transient local, newest sample per key: a late joiner gets the present state
};

/// What is wrong with a sample that was taken, for people.
using Invalid = std::string;

/// How values of type T travel. Specialised per type beside its codec (cell_topics.hpp, mes_topics.hpp) with
///   using Wire = ...;                 generated DDS type
///   using WireSupport = ...PubSubType;
///   static constexpr const char* kName;   DDS topic name, with ROS 2's "rt/" prefix
///   static constexpr Profile kProfile;
///   static void encode(const T&, Wire&);
///   static Result<T, Invalid> decode(const Wire&);   the door: checks every field that came from outside
template <typename T>
struct Topic;

}  // namespace breakshot::dds
