// SPDX-License-Identifier: Apache-2.0
// A rig with three faults at once, in the daemon's words: a lost camera, a silent strobe, a disk that fills up. And one that sees no lamp.
import type {DaemonStatus, Fault} from '../../../daemon/console/src/api.gen';
import {aligning, camera, cameraId, capturing, idle, kCameras} from './scene';

const kLost = 3;

function faults(): Fault[] {
  const since = (seconds: number) => new Date(Date.now() - 1000 * seconds).toISOString();
  return [
    {id: 4, kind: 'CAMERA_LOST', light: 'RED', subject: cameraId(kLost), what: 'The camera went away.', remedy: 'See to its cable and its power: it is taken up again by itself.', since_utc: since(74), over: false},
    {id: 5, kind: 'STROBE_SILENT', light: 'RED', subject: 'serial:/dev/ttyACM0', what: 'No answer within 0.5 s.', remedy: 'See to its power and its cable: it is asked again every second.', since_utc: since(41), over: false},
    {id: 6, kind: 'DISK_LOW', light: 'AMBER', subject: '', what: 'The disk has room for 3.2 minutes.', remedy: 'Free space, or record to another disk.', since_utc: since(8), over: false},
  ];
}

function broken(status: Partial<DaemonStatus>, reason: string): Partial<DaemonStatus> {
  return {
    ...status, light: 'RED', reason, faults: faults(), storage: {...status.storage!, free_bytes: 51.7e9, minutes_left: 3.2},
    strobe: {...status.strobe!, id: 'serial:/dev/ttyACM0', light: 'RED', reason: 'No answer within 0.5 s.'},
    cameras: status.cameras!.map((each, index) => index !== kLost ? each
      : camera(index, {state: 'LOST', light: 'RED', reason: 'Went away, is being looked for.', counts: {...each.counts!, transport: 31}})),
  };
}

export const faultyAligning = () => broken(aligning(9), 'Waiting for a camera that went away. 4 of 11 cameras are in tolerance; the widest pair is 1 310 rows apart, and 100 are allowed. It goes on by itself once the camera is back and the strobe answers.');
export const faultyCapturing = (seconds: number) => broken(capturing(seconds), 'Recording 2026-11-22_031500.');

/** As after an alignment with `exposure_ms = 4`: no camera shows the lamp. */
export function noLamp(): Partial<DaemonStatus> {
  const who = Array.from({length: kCameras}, (_, index) => cameraId(index)).join(', ');
  const what = `No phase of ${who} after 7 looks at different phases of the strobe: nothing in the frame is bright and compact enough to be the lamp.`;
  const remedy = 'Ask for a wider tolerance (those that can be met are listed), or check the cameras named.';
  return {...idle(), light: 'RED', reason: what, next_step: remedy, faults: [{id: 1, kind: 'NOT_ALIGNED', light: 'RED', subject: '', what, remedy, since_utc: new Date().toISOString(), over: false}]};
}
