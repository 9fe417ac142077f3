// The reader of the cell's configuration: any text is read, or refused with a ConfigError. The same reader is behind every file of config/ but the arms.

#include "common/config/cell_config.hpp"
#include "common/config/config_node.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

using namespace breakshot;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text{reinterpret_cast<const char*>(data), size};
  try {
    const ConfigDocument document = ConfigDocument::parse(text, BREAKSHOT_SOURCE_DIR "/config/fuzz.yaml");
    document.only_sections(kCellSections);
    (void)load_cell_config(document);
  } catch (const ConfigError&) {
  }
  try {
    // As the text of a --set.
    static const std::string shipped = "cell: {mode: lockstep, list: [1, 2]}\n";
    (void)ConfigDocument::parse(shipped, "shipped.yaml", std::vector<std::string>{std::string{text}});
  } catch (const ConfigError&) {
  }
  return 0;
}
