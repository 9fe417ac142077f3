// What may stand where a formation is asked for, and the files of config/formations: read, or refused with a ConfigError.

#include "common/config/cell_config.hpp"
#include "common/config/config_node.hpp"
#include "common/config/formation.hpp"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

using namespace breakshot;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const CellConfig cell = load_cell_config(load_cell_document(BREAKSHOT_SOURCE_DIR "/config/cell.yaml"));
  const std::string_view text{reinterpret_cast<const char*>(data), size};
  const auto check = [](const Formation& formation) {
    for (const FormationDisc& disc : formation.discs) {
      if (!disc.p_WD.allFinite() || !(disc.radius > 0.0) || disc.colour >= cell.colours.size()) std::abort();
    }
  };
  try {
    check(parse_formation(text, "fuzz.yaml", cell));
  } catch (const ConfigError&) {
  }
  try {
    check(load_formation(std::string{text}, cell));
  } catch (const ConfigError&) {
  }
  return 0;
}
