#pragma once

#include "common/geometry.hpp"

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace breakshot::world {

/// A contact between two bodies of an ImpactProblem.
struct ImpactContact {
  int a = 0, b = 0;          ///< indices into the problem's bodies
  Vector2 n_AB{1.0, 0.0};    ///< unit normal from a to b
  double restitution = 0.0;  ///< e, 0 ... 1
  double gap = 0.0;          ///< m, >= 0; only laws that heed_gaps() are told
};

/// Bodies that touch at one instant, some of which approach; the impact law changes their velocities.
///
/// Contacts are frictionless, as the paper assumes (Sec. 2), so impulses act along the normals.
struct ImpactProblem {
  std::span<const ImpactContact> contacts;
  std::span<const double> inverse_mass;  ///< per body, 1/kg; 0: driven, its velocity does not change
  std::span<Vector2> v;                  ///< per body, in W, m/s: before on entry, after on return
  double quiet = 0.0;                    ///< contacts that approach no faster than this may be left so, m/s
};

/// Working memory of a law, so that resolving allocates nothing once it has grown to the largest cluster.
struct ImpactScratch {
  std::vector<int> active;  // contacts, then whatever a law wants to mark
  std::vector<double> target;
  std::vector<double> impulse;
  std::vector<double> depth;
  std::vector<int> level;
  std::vector<Vector2> v_before;
  std::vector<Vector2> v_plastic;
};

/// How an impact changes velocities: the one thing about the virtual world that is a matter of modelling and not of computing
/// (errata.md, "Which impact law"). Stateless, so that one object serves all threads.
class ImpactLaw {
 public:
  virtual ~ImpactLaw() = default;
  virtual std::string_view name() const noexcept = 0;
  /// Whether the law makes no kinetic energy, whatever the contacts.
  virtual bool keeps_energy_bound() const noexcept = 0;
  /// Whether two bodies that touch no third part at e times the speed at which they met, so that nobody need ask the law about them.
  virtual bool bounces_pairs() const noexcept { return true; }
  /// Whether contacts with a gap up to WorldSettings::touch_gap take part as if they touched; else only those that do, to rounding (kContactSlack).
  virtual bool takes_near_contacts() const noexcept { return true; }
  /// Whether the law wants to know the gaps of contacts.
  virtual bool heeds_gaps() const noexcept { return false; }
  virtual void resolve(const ImpactProblem& problem, ImpactScratch& scratch) const = 0;
};

/// Speed at which the bodies of a contact approach, m/s; negative while they part.
inline double approach_speed(const ImpactContact& contact, std::span<const Vector2> v) noexcept {
  return (v[static_cast<std::size_t>(contact.a)] - v[static_cast<std::size_t>(contact.b)]).dot(contact.n_AB);
}

/// Gives bodies the impulse P along the normal: +P on b, -P on a.
inline void apply_impulse(const ImpactProblem& problem, const ImpactContact& contact, double P) noexcept {
  const auto a = static_cast<std::size_t>(contact.a);
  const auto b = static_cast<std::size_t>(contact.b);
  problem.v[a] -= P * problem.inverse_mass[a] * contact.n_AB;
  problem.v[b] += P * problem.inverse_mass[b] * contact.n_AB;
}

/// Kinetic energy of the bodies that are not driven, J.
double kinetic_energy(std::span<const double> inverse_mass, std::span<const Vector2> v) noexcept;

/// Names that make_impact_law() knows, the recommended one first. docs/strategies.md says when each is right.
std::vector<std::string> impact_law_names();

/// @throws std::invalid_argument for a name that is not among impact_law_names()
std::shared_ptr<const ImpactLaw> make_impact_law(std::string_view name);

}  // namespace breakshot::world
