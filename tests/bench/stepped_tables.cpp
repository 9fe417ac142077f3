#include "tests/bench/stepped_tables.hpp"

#include <box2d/box2d.h>
#include <ode/ode.h>

#include <algorithm>
#include <cmath>

namespace breakshot::bench {

namespace {

/// Coulomb friction over one step; whether the body still moves.
bool brake(Vector2& v, double deceleration, double step) {
  const double speed = v.norm();
  const double left = std::max(0.0, speed - deceleration * step);
  v *= speed > 0.0 ? left / speed : 0.0;
  return left > 0.0;
}

}  // namespace

struct OdeTable::Ode {
  dWorldID world = dWorldCreate();
  dJointGroupID contacts = dJointGroupCreate(0);
};

OdeTable::OdeTable(double friction, double restitution) : friction_{friction}, restitution_{restitution} {
  dInitODE2(0);
  ode_ = new Ode;
}

OdeTable::~OdeTable() {
  dJointGroupDestroy(ode_->contacts);
  dWorldDestroy(ode_->world);
  delete ode_;
  dCloseODE();
}

std::vector<Vector2> OdeTable::run(std::span<const world::Disc> discs, double step) {
  std::vector<dBodyID> bodies;
  for (const auto& disc : discs) {
    const dBodyID body = dBodyCreate(ode_->world);
    dMass mass;
    dMassSetSphereTotal(&mass, disc.mass, disc.radius);
    dBodySetMass(body, &mass);
    dBodySetPosition(body, disc.p_WD.x(), disc.p_WD.y(), 0.0);
    dBodySetLinearVel(body, disc.v_WD_W.x(), disc.v_WD_W.y(), 0.0);
    bodies.push_back(body);
  }
  const auto planar = [](const dReal* v) { return Vector2{v[0], v[1]}; };
  bool moving = true;
  while (moving) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      for (std::size_t j = i + 1; j < bodies.size(); ++j) {
        const Vector2 p = planar(dBodyGetPosition(bodies[i])) - planar(dBodyGetPosition(bodies[j]));
        const double reach = discs[i].radius + discs[j].radius;
        if (p.squaredNorm() >= reach * reach) continue;
        const Vector2 n = p.normalized();
        if ((planar(dBodyGetLinearVel(bodies[i])) - planar(dBodyGetLinearVel(bodies[j]))).dot(n) >= 0.0) continue;
        dContact contact{};
        contact.surface.mode = dContactBounce;
        contact.surface.bounce = restitution_;
        contact.geom.normal[0] = n.x();
        contact.geom.normal[1] = n.y();
        const Vector2 at = planar(dBodyGetPosition(bodies[j])) + discs[j].radius * n;
        contact.geom.pos[0] = at.x();
        contact.geom.pos[1] = at.y();
        dJointAttach(dJointCreateContact(ode_->world, ode_->contacts, &contact), bodies[i], bodies[j]);
      }
    }
    dWorldQuickStep(ode_->world, step);
    dJointGroupEmpty(ode_->contacts);
    moving = false;
    for (const dBodyID body : bodies) {
      Vector2 v = planar(dBodyGetLinearVel(body));
      moving = brake(v, friction_ * kGravity, step) || moving;
      dBodySetLinearVel(body, v.x(), v.y(), 0.0);
    }
  }
  std::vector<Vector2> rest;
  for (const dBodyID body : bodies) {
    rest.push_back(planar(dBodyGetPosition(body)));
    dBodyDestroy(body);
  }
  return rest;
}

std::vector<Vector2> Box2dTable::run(std::span<const world::Disc> discs, double step) const {
  b2World world{b2Vec2{0.0F, 0.0F}};
  std::vector<b2Body*> bodies;
  const auto single = [](const Vector2& v) { return b2Vec2{static_cast<float>(v.x()), static_cast<float>(v.y())}; };
  for (const auto& disc : discs) {
    b2BodyDef def;
    def.type = b2_dynamicBody;
    def.position = single(disc.p_WD);
    def.linearVelocity = single(disc.v_WD_W);
    def.allowSleep = false;
    b2Body* body = world.CreateBody(&def);
    b2CircleShape shape;
    shape.m_radius = static_cast<float>(disc.radius);
    b2FixtureDef fixture;
    fixture.shape = &shape;
    fixture.density = static_cast<float>(disc.mass / (b2_pi * disc.radius * disc.radius));
    fixture.friction = 0.0F;
    fixture.restitution = static_cast<float>(restitution_);
    fixture.restitutionThreshold = 0.0F;
    body->CreateFixture(&fixture);
    bodies.push_back(body);
  }
  bool moving = true;
  while (moving) {
    world.Step(static_cast<float>(step), 8, 3);
    moving = false;
    for (b2Body* body : bodies) {
      Vector2 v{body->GetLinearVelocity().x, body->GetLinearVelocity().y};
      moving = brake(v, friction_ * kGravity, step) || moving;
      body->SetLinearVelocity(single(v));
    }
  }
  std::vector<Vector2> rest;
  for (const b2Body* body : bodies) rest.emplace_back(body->GetPosition().x, body->GetPosition().y);
  return rest;
}

}  // namespace breakshot::bench
