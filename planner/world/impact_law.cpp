#include "planner/world/impact_law.hpp"

#include "planner/world/laws/compliant.hpp"
#include "planner/world/laws/corrected_laws.hpp"
#include "planner/world/laws/paper_laws.hpp"

#include <stdexcept>

namespace breakshot::world {

namespace {

const std::vector<std::shared_ptr<const ImpactLaw>>& laws() {
  static const std::vector<std::shared_ptr<const ImpactLaw>> all{
      std::make_shared<PaperCorrected>(),         std::make_shared<Sequential>(), std::make_shared<Simultaneous>(),
      std::make_shared<GeneralisedReflections>(), std::make_shared<Compliant>(),  std::make_shared<PaperSumRule>(),
      std::make_shared<PaperAsPrinted>(),
  };
  return all;
}

}  // namespace

double kinetic_energy(std::span<const double> inverse_mass, std::span<const Vector2> v) noexcept {
  double energy = 0.0;
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (inverse_mass[i] > 0.0) energy += 0.5 * v[i].squaredNorm() / inverse_mass[i];
  }
  return energy;
}

std::vector<std::string> impact_law_names() {
  std::vector<std::string> names;
  for (const auto& law : laws()) names.emplace_back(law->name());
  return names;
}

std::shared_ptr<const ImpactLaw> make_impact_law(std::string_view name) {
  std::string known;
  for (const auto& law : laws()) {
    if (law->name() == name) return law;
    known += (known.empty() ? "" : ", ") + std::string{law->name()};
  }
  throw std::invalid_argument("impact law: found \"" + std::string{name} + "\"; allowed: " + known);
}

}  // namespace breakshot::world
