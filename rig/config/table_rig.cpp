// SPDX-License-Identifier: Apache-2.0
#include "rig/config/keys.h"

// All keys of [rig] and its subsections, except [[rig.camera]].
namespace emberlock::rig::config {
namespace {

Section<DaemonConfig> make_rig_section() {
  using C = DaemonConfig;
  return {
      "rig",
      "The cameras and the strobe. One rig may mix cameras of all drivers.",
      {text<C>("name", EMBERLOCK_AT(rig.name), "text", "Name of the rig in the console."),
       text<C>(
           "calibration", EMBERLOCK_AT(rig.calibration), kPath,
           "A transforms.json with poses, lenses and the box; its frame CAMERA-ID.png belongs to the camera "
           "with that id. It is stored in recordings, which only then can be reconstructed. None if absent.",
           "\"transforms.json\"")}};
}

Section<DaemonConfig> make_virtual_section() {
  using C = DaemonConfig;
  using Time = VirtualConfig::Time;
  using Scene = VirtualConfig::Scene;
  using Models = drivers::VirtualRigDraw::Models;
  return {
      "rig.virtual",
      "Settings that virtual cameras and their strobe share.",
      {choice<C>("time", EMBERLOCK_AT(rig.virtual_rig.time), {{"real", Time::real}, {"fast", Time::fast}},
                 "\"fast\": the rig's clock runs as fast as pictures are rendered; not possible together "
                 "with real devices."),
       choice<C>(
           "scene", EMBERLOCK_AT(rig.virtual_rig.scene),
           {{"dark-room", Scene::dark_room}, {"lit-room", Scene::lit_room}, {"flame", Scene::flame}},
           "What the cameras see beside the strobe. Sensors without smear see flashes only in \"lit-room\"."),
       number<C>("seed", EMBERLOCK_AT(rig.virtual_rig.draw.seed), {0, 1e9}, "Seed of all random numbers."),
       choice<C>("models", EMBERLOCK_AT(rig.virtual_rig.draw.models),
                 {{"same", Models::same}, {"mixed", Models::mixed}},
                 "\"same\": all cameras are of one model. \"mixed\": they differ in direction and shifts."),
       number<C>("crystal_spread_ppm", EMBERLOCK_AT(rig.virtual_rig.draw.crystal_spread), {0, 1000},
                 "Largest frequency error of a camera's clock."),
       number<C>("reset_latency_ms", EMBERLOCK_AT(rig.virtual_rig.draw.reset_latency), {0, 10000, kMilli},
                 "Delay from a reset to the new phase, mean over cameras."),
       number<C>("reset_jitter_ms", EMBERLOCK_AT(rig.virtual_rig.draw.reset_jitter), {0, 1000, kMilli},
                 "RMS jitter of that delay, for resets on command."),
       text<C>("light", EMBERLOCK_AT(rig.virtual_rig.light), kPath,
               "File through which simulated cameras of several daemons on one machine see one simulated "
               "strobe. The daemon whose rig has the strobe writes it, the others read it. None if absent.",
               "\"light.txt\"")}};
}

Section<DaemonConfig> make_replay_section() {
  using C = DaemonConfig;
  return {
      "rig.replay",
      "A recorded session, for cameras and a strobe of driver \"replay\".",
      {text<C>("session", EMBERLOCK_AT(rig.replay_session), kPath, "The session's folder.", "\"session\"")}};
}

Section<DaemonConfig> make_strobe_section() {
  using C = DaemonConfig;
  return {
      "rig.strobe",
      "The strobe, or the pulse generator that triggers it.",
      {choice<C>(
           "driver", EMBERLOCK_AT(rig.strobe.source),
           {{"none", StrobeSource::none},
            {"virtual", StrobeSource::virtual_},
            {"serial", StrobeSource::serial},
            {"replay", StrobeSource::replay},
            {"manual", StrobeSource::manual}},
           "Kind of strobe. \"manual\" is a stroboscope with a dial and no interface: the daemon says what "
           "to set, and measures from the frames what was set. Without a strobe nothing can be aligned."),
       number<C>("dial_step", EMBERLOCK_AT(rig.strobe.dial.step), {0.001, 100, 1.0 / 60},
                 "Step of a manual strobe's dial, in flashes per minute."),
       text<C>("id", EMBERLOCK_AT(rig.strobe.id), "text",
               "Id of the serial port, as `emberlock devices` prints it.", "\"ttyUSB0\""),
       choice<C>("dialect", EMBERLOCK_AT(rig.strobe.request.dialect),
                 named<drivers::StrobeDialect>(
                     {drivers::StrobeDialect::emberlock, drivers::StrobeDialect::scpi,
                      drivers::StrobeDialect::siglent_bswv, drivers::StrobeDialect::gardasoft_rt,
                      drivers::StrobeDialect::schott_cv_ls},
                     [](drivers::StrobeDialect d) { return drivers::name_of(d); }),
                 "Command language on the serial line; `emberlock devices probe ID` detects it."),
       number<C>("baud", EMBERLOCK_AT(rig.strobe.request.baud), {300, 4000000},
                 "Baud rate of the serial line; the dialect's usual one if absent.", "115200"),
       number<C>("channel", EMBERLOCK_AT(rig.strobe.request.options.channel), {1, 8},
                 "Output to use, for a device with several."),
       number<C>("brightness_percent", EMBERLOCK_AT(rig.strobe.request.options.brightness), {0.1, 100},
                 "Brightness of the flashes, for controllers that can set it (Gardasoft)."),
       choice<C>("scpi_phase", EMBERLOCK_AT(rig.strobe.request.options.phase),
                 {{"start", drivers::ScpiPhase::start}, {"delay", drivers::ScpiPhase::delay}},
                 "What the generator means by PHASe: the angle at which a period starts, or a delay (Agilent "
                 "81100)."),
       number<C>("watchdog_s", EMBERLOCK_AT(rig.strobe.request.options.watchdog), {0, 600},
                 "Emberlock's controller goes dark when it gets no command for so long; 0: never, else at "
                 "least 0.1."),
       number<C>("patience_s", EMBERLOCK_AT(rig.strobe.request.patience), {0.1, 60},
                 "Longest wait for the first answer; opening the port may have reset the device.")}};
}

}  // namespace

std::vector<Section<DaemonConfig>> rig_sections() {
  return {make_rig_section(), make_virtual_section(), make_replay_section(), make_strobe_section()};
}

}  // namespace emberlock::rig::config
