// The reader of arms: any text gives an arm whose numbers the cell can work with, or an ArmDescriptionError.

#include "common/urdf/arm_description.hpp"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

using namespace breakshot;

// urdfdom keeps links that hang together in a ring alive for ever. The cell reads one arm per life of a process.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:liburdfdom\n"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const ArmDescription arm = parse_arm(std::string{reinterpret_cast<const char*>(data), size}, "fuzz.urdf", "base_link", "striker_tip");
    if (arm.joints.empty() || arm.joints.size() != arm.links.size()) std::abort();
    for (const JointDescription& joint : arm.joints) {
      if (!joint.X_PL.matrix().allFinite() || !(joint.lower < joint.upper) || !(joint.max_speed > 0.0) || !joint.axis_L.allFinite())
        std::abort();
    }
    for (const LinkDescription& link : arm.links) {
      if (!(link.mass > 0.0) || !link.I_Com_L.allFinite()) std::abort();
    }
  } catch (const ArmDescriptionError&) {
  }
  return 0;
}
