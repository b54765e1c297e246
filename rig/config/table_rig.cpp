// SPDX-License-Identifier: Apache-2.0
#include "rig/config/keys.h"

// Every key of [rig] and below but [[rig.camera]].
namespace emberlock::rig::config {
namespace {

Section<DaemonConfig> make_rig_section() {
  using C = DaemonConfig;
  return {
      "rig",
      "What is filmed with. Cameras of all drivers mix freely in one rig.",
      {text<C>("name", EMBERLOCK_AT(rig.name), "text", "What the console calls it."),
       text<C>("calibration", EMBERLOCK_AT(rig.calibration), kPath,
               "A transforms.json with poses, lenses and the box; the frame CAMERA-ID.png is that camera's. "
               "Recordings "
               "carry it, and can be reconstructed. None if absent.",
               "\"transforms.json\"")}};
}

Section<DaemonConfig> make_virtual_section() {
  using C = DaemonConfig;
  using Time = VirtualConfig::Time;
  using Scene = VirtualConfig::Scene;
  using Models = drivers::VirtualRigDraw::Models;
  return {
      "rig.virtual",
      "What virtual cameras and their strobe share.",
      {choice<C>("time", EMBERLOCK_AT(rig.virtual_rig.time), {{"real", Time::real}, {"fast", Time::fast}},
                 "\"fast\" lets the rig's clock run as fast as pictures are drawn; not beside real devices."),
       choice<C>("scene", EMBERLOCK_AT(rig.virtual_rig.scene),
                 {{"dark-room", Scene::dark_room}, {"lit-room", Scene::lit_room}, {"flame", Scene::flame}},
                 "What they see beside the strobe. Shutters without smear see flashes in a lit room alone."),
       number<C>("seed", EMBERLOCK_AT(rig.virtual_rig.draw.seed), {0, 1e9},
                 "Of everything that is drawn by chance."),
       choice<C>("models", EMBERLOCK_AT(rig.virtual_rig.draw.models),
                 {{"same", Models::same}, {"mixed", Models::mixed}},
                 "Whether the cameras are of one model, or differ in direction and shifts."),
       number<C>("crystal_spread_ppm", EMBERLOCK_AT(rig.virtual_rig.draw.crystal_spread), {0, 1000},
                 "Each camera's clock is off by up to this."),
       number<C>("reset_latency_ms", EMBERLOCK_AT(rig.virtual_rig.draw.reset_latency), {0, 10000, kMilli},
                 "From a reset to the new phase, mean over cameras."),
       number<C>("reset_jitter_ms", EMBERLOCK_AT(rig.virtual_rig.draw.reset_jitter), {0, 1000, kMilli},
                 "RMS of that, of resets on command.")}};
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
           "How it is reached. \"manual\" is a stroboscope with a dial, that no program can talk to: the "
           "daemon says what to set, and reads from the frames what was set. Without a strobe nothing can "
           "be aligned."),
       number<C>("dial_step", EMBERLOCK_AT(rig.strobe.dial.step), {0.001, 100, 1.0 / 60},
                 "Between two settings of a manual strobe's dial, in flashes a minute."),
       text<C>("id", EMBERLOCK_AT(rig.strobe.id), "text",
               "Of the serial port, as `emberlock devices` names it.", "\"ttyUSB0\""),
       choice<C>("dialect", EMBERLOCK_AT(rig.strobe.request.dialect),
                 named<drivers::StrobeDialect>(
                     {drivers::StrobeDialect::emberlock, drivers::StrobeDialect::scpi,
                      drivers::StrobeDialect::siglent_bswv, drivers::StrobeDialect::gardasoft_rt,
                      drivers::StrobeDialect::schott_cv_ls},
                     [](drivers::StrobeDialect d) { return drivers::name_of(d); }),
                 "Its language on the serial line; `emberlock devices probe ID` finds it out."),
       number<C>("baud", EMBERLOCK_AT(rig.strobe.request.baud), {300, 4000000},
                 "The dialect's own if absent.", "115200"),
       number<C>("channel", EMBERLOCK_AT(rig.strobe.request.options.channel), {1, 8},
                 "Of a device with several outputs."),
       number<C>("brightness_percent", EMBERLOCK_AT(rig.strobe.request.options.brightness), {0.1, 100},
                 "Of controllers that set it (Gardasoft)."),
       choice<C>(
           "scpi_phase", EMBERLOCK_AT(rig.strobe.request.options.phase),
           {{"start", drivers::ScpiPhase::start}, {"delay", drivers::ScpiPhase::delay}},
           "What a generator means by PHASe: the angle where a period starts, or a delay (Agilent 81100)."),
       number<C>("watchdog_s", EMBERLOCK_AT(rig.strobe.request.options.watchdog), {0, 600},
                 "Our own controller goes dark when told nothing for so long; 0: never, else 0.1 at least."),
       number<C>("patience_s", EMBERLOCK_AT(rig.strobe.request.patience), {0.1, 60},
                 "For its first answer: opening the port may have reset it.")}};
}

}  // namespace

std::vector<Section<DaemonConfig>> rig_sections() {
  return {make_rig_section(), make_virtual_section(), make_replay_section(), make_strobe_section()};
}

}  // namespace emberlock::rig::config
