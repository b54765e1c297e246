// SPDX-License-Identifier: Apache-2.0
#include <cctype>

#include "rig/config/keys.h"

// The configuration as text: as a template with every key commented out, and with the values in effect.
namespace emberlock::rig {
namespace {
using config::Key;
using config::Section;

constexpr std::size_t kWidth = 100;

/// `text` as comment lines.
std::string comment(std::string_view text) {
  std::string lines;
  std::size_t column = 0;
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find(' '));
    text.remove_prefix(std::min(word.size() + 1, text.size()));
    if (column == 0 || column + 1 + word.size() > kWidth) {
      lines += column == 0 ? "#" : "\n#";
      column = 1;
    }
    (lines += ' ') += word;
    column += 1 + word.size();
  }
  return lines + "\n";
}

/// Writes a section. Keys whose value differs from `unsaid` are written as they are, others are commented out
/// with their defaults.
template <class T>
std::string commented(const Section<T>& section, const char* open, const char* close, const T& in_force,
                      const T& unsaid) {
  std::string text = comment(section.words) + open + section.name + close + "\n";
  const T defaults{};
  for (const Key<T>& key : section.keys) {
    std::string takes = key.takes + ".";
    takes.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(takes.front())));
    if (!key.applies_words.empty()) takes += " For cameras " + key.applies_words + ".";
    const std::string said = key.write(in_force);
    const std::string value = key.write(defaults);
    text += "\n" + comment(key.sentence + " " + takes);
    if (said != key.write(unsaid)) {
      text += key.name + " = " + said + "\n";
    } else {
      text += "#" + key.name + " = " + (value.empty() ? key.example + "  # for example" : value) + "\n";
    }
  }
  return text + "\n";
}

template <class T>
std::string printed(const Section<T>& section, const T& from) {
  std::string text;
  const T defaults{};
  for (const Key<T>& key : section.keys) {
    if (key.applies && !key.applies(from)) continue;
    std::string value = key.write(from);
    if (value.empty() && !key.write(defaults).empty()) value = R"("")";  // set to empty on purpose
    if (!value.empty()) text += key.name + " = " + value + "\n";
  }
  return text + "\n";
}

}  // namespace

std::string commented_config() {
  // A rig that works on every machine, to try the program. A camera needs a driver.
  CameraConfig camera;
  camera.count = 4;
  camera.request.size = ImageSize{640, 480};
  CameraConfig unsaid;
  unsaid.source = CameraSource::replay;
  DaemonConfig config;
  config.rig.name = "four simulated cameras";
  config.rig.strobe.source = StrobeSource::virtual_;

  std::string text = comment(
      "The configuration of emberlockd(8). It starts with a simulated rig, so that it works everywhere; "
      "replace it by the cameras and serial ports that `emberlock devices` lists. A line after a bare # is a "
      "key with its default: remove the # and change the value. `emberlockd --check-config` says what is "
      "wrong with a file. Relative paths are relative to the file's folder.");
  text += "\n";
  for (const auto& section : config::sections()) {
    text += commented(section, "[", "]", config, DaemonConfig{});
    if (section.name == "rig") text += commented(config::camera_section(), "[[", "]]", camera, unsaid);
  }
  return text;
}

std::string print_config(const DaemonConfig& config) {
  std::string text;
  for (const auto& section : config::sections()) {
    text += "[" + section.name + "]\n" + printed(section, config);
    if (section.name != "rig") continue;
    for (const CameraConfig& camera : config.rig.cameras)
      text += "[[rig.camera]]\n" + printed(config::camera_section(), camera);
  }
  return text;
}

}  // namespace emberlock::rig
