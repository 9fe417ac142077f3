#pragma once

#include "planner/world/impact_law.hpp"

namespace breakshot::world {

/// The paper's propagation "level by level" with its rule "add the results" (Sec. 3.1): each disc that moves strikes the touching discs
/// that no impact has reached yet, in one analysis of its own; a disc struck by two discs gets the sum of both results. There is no test
/// that impulses push, and nothing looks back at contacts between levels passed.
///
/// Readings of what the paper leaves open: a level strikes the contacts that approach ("approaching and contacting", Sec. 3.2); with one
/// disc ahead the two-body equations (14)-(18) serve, with two the three-disc equations, with more the same equations for all of them.
class PaperPropagation : public ImpactLaw {
 public:
  bool keeps_energy_bound() const noexcept override { return false; }
  void resolve(const ImpactProblem& problem, ImpactScratch& scratch) const final;

 protected:
  PaperPropagation() = default;
  /// Whether (9), (10) and (17) stand as they are printed.
  virtual bool as_printed() const noexcept = 0;
};

/// Everything as printed, slips included: (9), (10) take the striking disc's velocity mirrored in the bisector of the two normals, and
/// (17) gives disc B the impulse of disc A, so that a two-body impact moves both the same way and they go on approaching. A world under
/// this law therefore stops at the first two-body impact, and says so (Rollout::Status::kLawFailed).
class PaperAsPrinted final : public PaperPropagation {
 public:
  std::string_view name() const noexcept override { return "paper_as_printed"; }
  bool bounces_pairs() const noexcept override { return false; }

 protected:
  bool as_printed() const noexcept override { return true; }
};

/// The paper's results (11)-(13) with its sum rule and without its slips in (9), (10), (17): what its authors must have run. For two discs
/// ahead at 60 degrees it is (11)-(13) to the digit. Makes energy where two discs strike one (errata.md).
class PaperSumRule final : public PaperPropagation {
 public:
  std::string_view name() const noexcept override { return "paper_sum_rule"; }

 protected:
  bool as_printed() const noexcept override { return false; }
};

}  // namespace breakshot::world
