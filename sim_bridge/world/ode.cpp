#include "sim_bridge/world/ode.hpp"

namespace breakshot::sim_bridge::ode {
namespace {

/// ODE's global state, for the life of the program.
class Library {
 public:
  Library() { dInitODE2(0); }
  ~Library() { dCloseODE(); }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
  Library(Library&&) = delete;
  Library& operator=(Library&&) = delete;
};

dWorldID create_world() {
  static const Library library;
  return dWorldCreate();
}

}  // namespace

World::World() : threading_{nullptr}, world_{create_world()} {
  threading_ = dThreadingAllocateSelfThreadedImplementation();
  dWorldSetStepThreadingImplementation(world_, dThreadingImplementationGetFunctions(threading_), threading_);
}

World::~World() {
  dWorldDestroy(world_);
  dThreadingFreeImplementation(threading_);
}

void set_pose(dBodyID body, const Pose& X) noexcept {
  const Matrix3 R = X.linear();
  const Vector3 p = X.translation();
  const dMatrix3 rows = {R(0, 0), R(0, 1), R(0, 2), 0.0, R(1, 0), R(1, 1), R(1, 2), 0.0, R(2, 0), R(2, 1), R(2, 2), 0.0};
  dBodySetRotation(body, rows);
  dBodySetPosition(body, p.x(), p.y(), p.z());
}

Pose pose(dBodyID body) noexcept {
  const dReal* R = dBodyGetRotation(body);
  Pose X = Pose::Identity();
  X.linear() << R[0], R[1], R[2], R[4], R[5], R[6], R[8], R[9], R[10];
  X.translation() = to_vector(dBodyGetPosition(body));
  return X;
}

}  // namespace breakshot::sim_bridge::ode
