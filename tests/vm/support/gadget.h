// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include <unistd.h>

namespace emberlock {

/// A USB serial device (CDC-ACM) made of the kernel's own gadget driver and looped back to this machine by
/// dummy_hcd: its device side is /dev/ttyGS0, its host side /dev/ttyACM*. Plugged in when made.
class SerialGadget {
 public:
  explicit SerialGadget(const std::string& serial) : root_("/sys/kernel/config/usb_gadget/strobe") {
    namespace fs = std::filesystem;
    run("modprobe dummy_hcd && modprobe libcomposite && modprobe cdc-acm");
    if (!fs::exists("/sys/kernel/config/usb_gadget")) run("mount -t configfs none /sys/kernel/config");
    fs::create_directories(root_);
    write("idVendor", "0x2341");
    write("idProduct", "0x0043");
    fs::create_directories(root_ / "strings/0x409");
    write("strings/0x409/serialnumber", serial);
    write("strings/0x409/manufacturer", "Emberlock");
    write("strings/0x409/product", "strobe controller");
    fs::create_directories(root_ / "configs/c.1");
    fs::create_directories(root_ / "functions/acm.usb0");
    fs::create_directory_symlink(root_ / "functions/acm.usb0", root_ / "configs/c.1/acm.usb0");
    plug();
  }
  SerialGadget(const SerialGadget&) = delete;
  SerialGadget& operator=(const SerialGadget&) = delete;
  ~SerialGadget() {
    namespace fs = std::filesystem;
    unplug();
    fs::remove(root_ / "configs/c.1/acm.usb0");
    for (const char* part : {"configs/c.1", "functions/acm.usb0", "strings/0x409", ""})
      ::rmdir((root_ / part).c_str());
  }

  void plug() { write("UDC", "dummy_udc.0"); }
  void unplug() { write("UDC", "\n"); }
  bool ready() const { return !failed_; }

 private:
  void run(const char* command) { failed_ = failed_ || std::system(command) != 0; }
  void write(const char* file, std::string_view value) {
    std::ofstream out(root_ / file);
    out << value << std::flush;
    failed_ = failed_ || (!out && value != "\n");
  }

  std::filesystem::path root_;
  bool failed_ = false;
};

}  // namespace emberlock
