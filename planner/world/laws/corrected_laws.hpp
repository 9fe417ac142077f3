#pragma once

#include "planner/world/impact_law.hpp"

namespace breakshot::world {

/// The paper's level-by-level propagation with what errata.md corrects: all contacts that approach are solved together with the
/// paper's own equations (1)-(4) and impulses that only push; then the contacts are looked at again, until none approaches. These are the
/// rounds of the "generalised reflections" of Smith et al. 2012 (below), with Newton's restitution in each. Right for touching discs whose contacts pass the impulse on one
/// after the other; wrong by the figures of errata.md where contacts are loaded at the same time.
///
/// Energy: a round changes it by -(1 - e) sum(P u) / 2 <= 0 (P, u >= 0). Should rounds not end (restitution near 0 between many discs
/// approaches rest geometrically), the last one solves all contacts with e = 0, after which none approaches; it costs energy too.
class PaperCorrected final : public ImpactLaw {
 public:
  std::string_view name() const noexcept override { return "paper_corrected"; }
  bool keeps_energy_bound() const noexcept override { return true; }
  void resolve(const ImpactProblem& problem, ImpactScratch& scratch) const override;
};

/// One complementarity problem over all contacts at once, those that merely touch included: what rigid-body engines do. Contacts that part
/// stay out of it, for otherwise it could make energy; should one approach afterwards, another round follows.
class Simultaneous final : public ImpactLaw {
 public:
  std::string_view name() const noexcept override { return "simultaneous"; }
  bool keeps_energy_bound() const noexcept override { return true; }
  void resolve(const ImpactProblem& problem, ImpactScratch& scratch) const override;
};

/// "Generalised reflections" with "generalised restitution" (B. Smith, D. Kaufman, E. Vouga, R. Tamstorf, E. Grinspun, Reflections on Simultaneous
/// Impact, SIGGRAPH 2012): contacts that approach are reflected together without loss, again and again until none approaches; what is left is
/// between that and the plastic outcome, as e says. Keeps symmetry, energy (both ends do, and energy is convex) and breaking away. Where rounds of
/// PaperCorrected lose energy each, here the whole impact does once. Several e in one impact, as with a striker, are taken as their mean.
class GeneralisedReflections final : public ImpactLaw {
 public:
  std::string_view name() const noexcept override { return "generalised_reflections"; }
  bool keeps_energy_bound() const noexcept override { return true; }
  void resolve(const ImpactProblem& problem, ImpactScratch& scratch) const override;
};

/// One meeting after another, as they come: gaps, however narrow, are not taken for contacts. Only what meets at the same instant, to kContactSlack of way, is one
/// impact: pair by pair such a tie would go to whichever contact is listed first. It is solved by the rounds of PaperCorrected: for one disc that
/// meets two, (11)-(13) of the paper with impulses that only push. Right when gaps are well above speed x contact time (physics.md 2), ties included;
/// where discs touch, right and wrong as PaperCorrected.
class Sequential final : public ImpactLaw {
 public:
  std::string_view name() const noexcept override { return "sequential"; }
  bool keeps_energy_bound() const noexcept override { return true; }
  bool takes_near_contacts() const noexcept override { return false; }
  void resolve(const ImpactProblem& problem, ImpactScratch& scratch) const override;
};

}  // namespace breakshot::world
