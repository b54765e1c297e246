// SPDX-License-Identifier: Apache-2.0
// States of a rig of eleven cameras, as the daemon would tell them.
import type {AlignmentStatus, CameraStatus, DaemonStatus, RecordingStatus, ReconstructionStatus, RoundPoint} from '../../../daemon/console/src/api.gen';

export const kTolerance = 100;    // rows
export const kRowTime = 54.03e-6; // s
export const kCameras = 11;

type Wire<T> = Partial<T>;

export const cameraId = (index: number) => `virtual-${String(index).padStart(2, '0')}`;

/** Error in rows of each camera after this many rounds: one after another comes in. */
export function errorAfter(index: number, round: number): number {
  const first = Math.round(9000 * Math.sin(2.3 * index + 0.7)) / 10;
  const settled = 12.4 * Math.cos(1.7 * index) + 0.3 * round;
  return round > 2 * index + 1 || index === 0 ? settled : first;
}

export function camera(index: number, change: Wire<CameraStatus> = {}): CameraStatus {
  return {
    id: cameraId(index), model: 'virtual CCD', driver: 'virtual', state: 'FILMING', light: 'GREEN', reason: 'Films.', width: 640, height: 480,
    frame_rate_hz: 24, measured_rate_hz: 24.0003, reset: 'BY_HAND', sensor: 'CCD', sight: '', resets: 0, reset_next: false, dots: [], band: [], lost_lately: 0, host: '',
    counts: {delivered: 7321, damaged: 0, camera_gap: 0, transport: 0, resend: 0, underrun: 0, queue: 0, passed_over: 240},
    ...change,
  };
}

/** As after a round of alignment. */
export function seen(index: number, round: number, next: boolean, change: Wire<CameraStatus> = {}): CameraStatus {
  const error = errorAfter(index, round);
  const inside = Math.abs(error) <= kTolerance;
  return camera(index, {
    light: inside ? 'GREEN' : next ? 'AMBER' : 'RED', sight: 'dot',
    reason: inside ? 'In tolerance.' : next ? 'Press its power button twice; it comes back by itself.' : 'Waits for its turn.',
    error_rows: error, error_s: error * kRowTime, sigma_rows: 0.4, drift_ppm: 3 * Math.sin(index), time_left_s: inside ? 400 + 13 * index : 0,
    resets: inside ? 1 + (index % 4) : 0, reset_next: next, lamp: {x: 320, y: 400}, lamp_radius: 26,
    dots: [{x: 320, y: 210 - error / 5}], target_row: 210, tolerance_rows: kTolerance / 5, band: [{first: 210 - kTolerance / 5, last: 210 + kTolerance / 5}], row_time_s: kRowTime, ...change,
  });
}

export function history(rounds: number): RoundPoint[] {
  return Array.from({length: rounds}, (_, round) => ({
    round: round + 1, at_s: 1.2 * round, resets: Math.floor(round / 2),
    error_rows: Array.from({length: kCameras}, (__, index) => (round === 0 && index === 5 ? ('NaN' as unknown as number) : errorAfter(index, round))),
  }));
}

const base: Wire<DaemonStatus> = {
  rig: 'virtual:11', version: '0.2.0', faults: [],
  storage: {folder: '/var/lib/emberlock', free_bytes: 412e9, floor_bytes: 5e9, bytes_per_s: 243e6, minutes_left: 27.9},
  strobe: {id: 'virtual', light: 'GREEN', reason: '', settings: {output: 'OFF', rate_hz: 24, phase_s: 0, width_s: 20e-6, code: []}, by_hand: false, measured_hz: 0},
};
const flashing = {...base.strobe!, settings: {...base.strobe!.settings!, output: 'FLASHING' as const}};

export function idle(): Wire<DaemonStatus> {
  return {...base, phase: 'IDLE', light: 'AMBER', reason: 'The cameras film, each at its own phase.', next_step: 'Set the strobe where all cameras see it, then align.',
          cameras: Array.from({length: kCameras}, (_, index) => camera(index)), alignment: undefined, recording: undefined, reconstruction: undefined};
}

export function alignment(round: number, change: Wire<AlignmentStatus> = {}): AlignmentStatus {
  return {policy: 'densest', tolerance_rows: kTolerance, tolerance_s: kTolerance * kRowTime, row_time_s: kRowTime, period_s: 1 / 24, round, resets: Math.floor(round / 2),
          checks: 0, verdict: 'GO_ON', reason: '', cost: {resets: 24.2, resets_p95: 41, time_s: 96, time_p95_s: 164}, offers: [], reset_next: '', history: history(round),
          leaves_first: '', shortest_take_s: 10, flame_speed_m_s: 2, detail_m: 0.004, staggered: false, ...change};
}

export function aligning(round: number): Wire<DaemonStatus> {
  const next = Array.from({length: kCameras}, (_, index) => index).find(index => Math.abs(errorAfter(index, round)) > kTolerance);
  return {...base, phase: 'ALIGNING', light: 'AMBER', reason: `${Array.from({length: kCameras}, (_, i) => errorAfter(i, round)).filter(e => Math.abs(e) <= kTolerance).length} of 11 cameras are in tolerance.`,
          next_step: next === undefined ? '' : `Press the shutter of ${cameraId(next)}.`,
          strobe: flashing, cameras: Array.from({length: kCameras}, (_, index) => seen(index, round, index === next)),
          alignment: alignment(round, {reset_next: next === undefined ? '' : cameraId(next)})};
}

export function locked(): Wire<DaemonStatus> {
  return {...base, phase: 'LOCKED', light: 'GREEN', reason: 'All 11 cameras are within 100 rows; the widest pair is 41 rows apart.', next_step: 'Record, or let it hold the lock.',
          strobe: flashing, cameras: Array.from({length: kCameras}, (_, index) => seen(index, 30, false)),
          alignment: alignment(24, {verdict: 'ALIGNED', reason: 'All cameras are in tolerance.', worst_pair_s: 2.215e-3, next_check_s: 124, time_left_s: 400, likely_left_s: 900, leaves_first: 'virtual-03', checks: 2})};
}

export function capturing(seconds: number, change: Wire<RecordingStatus> = {}): Wire<DaemonStatus> {
  const frames = Math.floor(24 * seconds) * kCameras;
  return {...locked(), phase: 'CAPTURING', light: 'GREEN', reason: 'Records all 11 cameras.', next_step: '',
          recording: {session: '2026-11-22_031500', state: 'RECORDING', purpose: 'flame', seconds, frames, bytes: frames * 307200, bytes_per_s: 81.1e6, queue_fill: 0.07,
                      progress: {arrived: frames + 66, queued: 11, written: frames + 55, safe: frames, at_risk_s: 0.3},
                      lost: {recorded: frames, camera_gap: 0, transport: 0, underrun: 0, queue: 0, disk: 0, passed_over: 0}, cameras: [], camera_progress: [], verdict: '', spread_s: 2.2e-3, hosts: [], ...change}};
}

export function reconstruction(iterations: number, change: Wire<ReconstructionStatus> = {}): ReconstructionStatus {
  return {id: 'r1', session: '2026-11-22_031500', state: 'RUNNING', fraction: iterations / 12, doing: 'adjusts the volume', device: 'CPU, 2 threads', seconds: 4 * iterations,
          iterations: Array.from({length: iterations}, (_, at) => iteration(at + 1)), result: '', effects: ['emission: the flame glows', 'no scattering: nothing in the scene calls for it'],
          advice: ['12 more iterations: 48 s, about 0.3 grey levels'], error: '', frames: [], temperature: [], ...change};
}

/** A sequence of these frames: 'd' is done, 'f' failed, 'r' runs, '-' waits. */
export function sequence(states: string, change: Wire<ReconstructionStatus> = {}): ReconstructionStatus {
  const names = {d: 'DONE', f: 'FAILED', r: 'RUNNING', '-': 'STATE_UNSPECIFIED'} as const;
  const frames = [...states].map((state, at) => ({frame: 10 + 2 * at, state: names[state as keyof typeof names], input_rmse: state === 'd' ? 2 + at / 10 : 0, error: state === 'f' ? 'It crashed by SIGSEGV. Try device cpu.' : '', temperature: ''}));
  return reconstruction(2, {id: 's1', frames, fraction: [...states].filter(state => state === 'd' || state === 'f').length / states.length,
                            doing: `frame ${10 + 2 * states.indexOf('r')} (${states.indexOf('r') + 1} of ${states.length}): iterating`, ...change});
}

export const iteration = (at: number) => ({iteration: at, seconds: 4 * at, input_rmse: 2.1 + 14 * Math.exp(-at / 3), heldout_rmse: 2.9 + 14 * Math.exp(-at / 3.3)});
