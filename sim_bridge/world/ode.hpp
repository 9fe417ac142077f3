#pragma once

#include "common/geometry.hpp"

#include <ode/ode.h>

namespace breakshot::sim_bridge::ode {

// Private to sim_bridge/world and sim_bridge/arm: no public header includes it.

/// An ODE world of its own: nothing in it is shared with another one, so worlds may live on different threads.
class World {
 public:
  World();
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  World(World&&) = delete;
  World& operator=(World&&) = delete;

  dWorldID id() const noexcept { return world_; }

 private:
  dThreadingImplementationID threading_;  // ODE's default is one job queue for all worlds, without locks
  dWorldID world_;
};

/// Contact joints of one step. Emptied, not freed, after it.
class JointGroup {
 public:
  JointGroup() : group_{dJointGroupCreate(0)} {}
  ~JointGroup() { dJointGroupDestroy(group_); }
  JointGroup(const JointGroup&) = delete;
  JointGroup& operator=(const JointGroup&) = delete;
  JointGroup(JointGroup&&) = delete;
  JointGroup& operator=(JointGroup&&) = delete;

  dJointGroupID id() const noexcept { return group_; }
  void clear() { dJointGroupEmpty(group_); }

 private:
  dJointGroupID group_;
};

inline Vector3 to_vector(const dReal* v) noexcept { return {v[0], v[1], v[2]}; }

/// Puts a body's own frame (its centre of mass) at X.
void set_pose(dBodyID body, const Pose& X) noexcept;
Pose pose(dBodyID body) noexcept;

}  // namespace breakshot::sim_bridge::ode
