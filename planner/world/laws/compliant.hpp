#pragma once

#include "planner/world/impact_law.hpp"

namespace breakshot::world {

/// Stiff contacts, integrated in time: a spring and a dashpot in each contact, which push and never pull. The referee: what rigid laws assume about the
/// order of impulses comes out of the springs here (physics.md 2: no rigid law is right where gaps are nothing).
///
/// Model: P. Cundall, O. Strack, A discrete numerical model for granular assemblies, 1979, linear, with the damping that gives a pair alone its e when
/// the contact ends with its force (T. Schwager, T. Poeschel, Granular Matter 9, 2007). Every contact would last contact_time alone. Contacts
/// with a gap close it first, so that groups of gaps up to speed x contact_time may be given to it; without gaps contact_time does not matter.
///
/// Right where contacts are linear and discs hardly move while they last. Breaks when they do move: normals and positions stand still meanwhile (a
/// few per cent of a radius in some ms); Hertz contacts are softer at first (on a six-disc rack, e = 0.8: v5 0.227; see the test). 7 to 30 times slower than the others.
///
/// Energy: integration errs by about a part in 1000; a result with more than there was is drawn to the centre of mass's velocity until it has as much,
/// which leaves momentum alone.
class Compliant final : public ImpactLaw {
 public:
  /// @param contact_time  of two bodies alone without damping, s, > 0; singulation.md takes 0.3 to 0.4 ms for discs of 30 mm
  /// @param steps  of the integration per contact time, > 0; e is right to about 1 / (3 steps)
  explicit Compliant(double contact_time = 3e-4, int steps = 400) : contact_time_{contact_time}, steps_{steps} {}
  std::string_view name() const noexcept override { return "compliant"; }
  bool keeps_energy_bound() const noexcept override { return true; }
  bool heeds_gaps() const noexcept override { return true; }
  void resolve(const ImpactProblem& problem, ImpactScratch& scratch) const override;

 private:
  double contact_time_;
  int steps_;
};

/// Damping of a linear contact, as a part of the critical one, for which two bodies that meet part at e times their speed, the contact ending when its
/// force does. e below 0.005 counts as that.
double damping_ratio(double e) noexcept;

}  // namespace breakshot::world
