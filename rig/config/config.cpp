// SPDX-License-Identifier: Apache-2.0
#include "rig/config/config.h"

#include <algorithm>
#include <system_error>

#include <unistd.h>

#include "base/file.h"
#include "base/nearest.h"
#include "rig/config/check.h"
#include "rig/config/keys.h"

namespace emberlock::rig {
namespace {
using config::Key;
using config::Section;

constexpr std::size_t kLargestFile = 1 << 20;

class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : file_(file) {}

  ConfigReading read(const toml::table& root) {
    check_names(root, "", known_in("", std::vector<Key<DaemonConfig>>{}));
    for (const auto& section : config::sections()) read_section(root, section);
    read_cameras(root);
    config::check_consistency(
        {reading_.config, root, [this](const toml::source_region& at, std::string what, std::string remedy) {
           problem(at, std::move(what), std::move(remedy));
         }});
    return take();
  }

  void problem(const toml::source_region& at, std::string what, std::string remedy) {
    problems_.emplace_back(
        at.begin,
        Error{ErrorKind::bad_input, std::move(what),
              fmt::format("{}:{}:{}", file_.string(), at.begin.line, at.begin.column), std::move(remedy)});
  }
  /// The result, with problems in the order of the file.
  ConfigReading take() {
    std::stable_sort(problems_.begin(), problems_.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (auto& [place, problem] : problems_) reading_.problems.push_back(std::move(problem));
    return std::move(reading_);
  }

 private:
  /// The allowed content of a table: its keys and direct subsections.
  template <class T>
  std::vector<std::string> known_in(const std::string& section, const std::vector<Key<T>>& keys) {
    std::vector<std::string> known(keys.size());
    std::transform(keys.begin(), keys.end(), known.begin(), [](const auto& key) { return key.name; });
    const std::string prefix = section.empty() ? "" : section + ".";
    const auto add = [&](const std::string& name) {
      if (name == section || !name.starts_with(prefix)) return;
      const std::string below = name.substr(prefix.size());
      if (below.find('.') == std::string::npos) known.push_back(below);
    };
    for (const auto& other : config::sections()) add(other.name);
    add(config::camera_section().name);
    return known;
  }

  void check_names(const toml::table& table, const std::string& section,
                   const std::vector<std::string>& known) {
    for (const auto& [key, node] : table) {
      const std::string name(key.str());
      if (std::find(known.begin(), known.end(), name) != known.end()) continue;
      const auto meant = nearest(name, known);
      std::string all;
      for (const std::string& each : known) all += (all.empty() ? "" : ", ") + each;
      const std::string where = section.empty() ? "" : " in [" + section + "]";
      problem(key.source(),
              fmt::format("there is no {} {}{}", node.is_table() ? "section" : "key", config::in_quotes(name),
                          where),
              meant ? fmt::format("did you mean {}?", *meant) : "there are " + all);
    }
  }

  template <class T>
  void read_keys(const toml::table& table, const Section<T>& section, T& target) {
    for (const Key<T>& key : section.keys) {
      const toml::node* node = table.get(key.name);
      if (node == nullptr) continue;
      if (key.applies && !key.applies(target)) {
        problem(node->source(), fmt::format("{} means nothing here: it is {}", key.name, key.applies_words),
                "leave it out");
      } else if (!key.read(*node, target)) {
        problem(node->source(), fmt::format("{} is {}", key.name, shown(*node)), "give " + key.takes);
      }
    }
  }

  static std::string shown(const toml::node& node) {
    if (const auto text = node.value<std::string>(); text && node.is_string()) {
      return config::in_quotes(text->substr(0, 60));
    }
    if (node.is_integer()) return fmt::format("{}", *node.value<std::int64_t>());
    if (node.is_floating_point()) return fmt::format("{}", *node.value<double>());
    if (node.is_boolean()) return *node.value<bool>() ? "true" : "false";
    return node.is_table() ? "a table" : node.is_array() ? "a list" : "a date or time";
  }

  void read_section(const toml::table& root, const Section<DaemonConfig>& section) {
    const toml::node* node = root.at_path(section.name).node();
    if (node == nullptr) return;
    const toml::table* table = node->as_table();
    if (table == nullptr) {
      problem(node->source(), section.name + " is no section",
              "write [" + section.name + "] on a line of its own");
      return;
    }
    check_names(*table, section.name, known_in(section.name, section.keys));
    read_keys(*table, section, reading_.config);
  }

  void read_cameras(const toml::table& root) {
    const Section<CameraConfig>& section = config::camera_section();
    const toml::node* node = root.at_path(section.name).node();
    if (node == nullptr) return;
    const toml::array* list = node->as_array();
    if (list == nullptr || !list->is_homogeneous(toml::node_type::table)) {
      problem(node->source(), section.name + " is no list of sections",
              "write [[" + section.name + "]] above each camera's keys");
      return;
    }
    for (const toml::node& entry : *list) {
      CameraConfig camera;
      const toml::table& table = *entry.as_table();
      check_names(table, section.name, known_in(section.name, section.keys));
      if (!table.contains("driver")) {
        problem(table.source(), "the camera has no driver", "say driver = " + section.keys.front().takes);
      }
      read_keys(table, section, camera);
      reading_.config.rig.cameras.push_back(std::move(camera));
    }
  }

  std::filesystem::path file_;
  ConfigReading reading_;
  std::vector<std::pair<toml::source_position, Error>> problems_;
};

/// Makes relative paths relative to the file's folder.
void anchor(DaemonConfig& config, const std::filesystem::path& folder) {
  const auto from_folder = [&](std::filesystem::path& path) {
    if (!path.empty() && path.is_relative()) path = (folder / path).lexically_normal();
  };
  from_folder(config.rig.calibration);
  from_folder(config.rig.replay_session);
  from_folder(config.rig.virtual_rig.light);
  from_folder(config.alignment.delays);
  from_folder(config.recording.folder);
  if (config.reconstruction.program.has_parent_path()) from_folder(config.reconstruction.program);
  ServerConfig& server = config.server;
  HostsConfig& hosts = config.hosts;
  for (auto* path : {&server.socket, &server.tls_certificate, &server.tls_key, &server.tls_clients,
                     &server.token_file, &server.console, &hosts.certificate, &hosts.key, &hosts.authority}) {
    from_folder(*path);
  }
}

/// PREFIX/share/emberlock/console for PREFIX/sbin/emberlockd, or `console` beside a build's bin/.
std::filesystem::path console_beside(const std::filesystem::path& program) {
  std::error_code error;
  const std::filesystem::path prefix = program.parent_path().parent_path();
  const std::filesystem::path built = prefix / "console";
  return std::filesystem::is_directory(built, error) ? built : prefix / "share/emberlock/console";
}

/// The emberlock of the same build or prefix; a bare name where there is none.
std::filesystem::path emberlock_beside(const std::filesystem::path& program) {
  const std::filesystem::path prefix = program.parent_path().parent_path();
  for (const std::filesystem::path& path : {program.parent_path() / "emberlock", prefix / "bin/emberlock"})
    if (::access(path.c_str(), X_OK) == 0) return path;
  return "emberlock";
}

}  // namespace

ConfigReading read_config(std::string_view text, const std::filesystem::path& file) {
  Reader reader(file);
  try {
    ConfigReading reading = reader.read(toml::parse(text));
    anchor(reading.config, file.parent_path());
    return reading;
  } catch (const toml::parse_error& error) {
    reader.problem(error.source(), std::string(error.description()),
                   "see https://toml.io for how TOML is written");
    return reader.take();
  }
}

Result<DaemonConfig> parse_config(std::string_view text, const std::filesystem::path& file) {
  ConfigReading reading = read_config(text, file);
  if (!reading.problems.empty()) return std::move(reading.problems.front());
  return std::move(reading.config);
}

void fill_in(DaemonConfig& config, const DaemonFolders& folders, const std::filesystem::path& program) {
  if (config.server.socket.empty()) config.server.socket = folders.socket();
  if (config.recording.folder.empty()) config.recording.folder = folders.sessions();
  if (config.server.console.empty()) config.server.console = console_beside(program);
  if (config.reconstruction.program.empty()) config.reconstruction.program = emberlock_beside(program);
}

Result<DaemonConfig> load_config(const std::filesystem::path& file) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(file, kLargestFile));
  EMBERLOCK_ASSIGN_OR_RETURN(DaemonConfig config, parse_config(text, file));
  std::error_code unknown;
  fill_in(config, daemon_folders(), std::filesystem::read_symlink("/proc/self/exe", unknown));
  return config;
}

}  // namespace emberlock::rig
