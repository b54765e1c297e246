// SPDX-License-Identifier: Apache-2.0
// Cameras that don't see the lamp: no tolerance helps where it isn't in the picture.
import type {CameraStatus, Fault} from './api.gen';
import {fixed} from './format';

// What the detector says of a frame without a lamp (smear_sync/detect), and the comb of one (smear_sync/sensors).
const hidden = /enough to be the lamp|no lamp stands out|no row was lit by a flash|centre lies outside the frame|no frame shows the lamp|scene, not a lamp/;

/** Whether this sentence of the daemon says that a lamp isn't seen. */
export function lampHidden(words: string): boolean {
  return hidden.test(words);
}

/** What to do about it: a shutter that is open for a part of the frame misses most flashes. */
export function lampAdvice(camera: CameraStatus | undefined): string {
  const rate = camera?.frame_rate_hz ?? 0;
  const whole = rate > 0 ? `, up to the whole frame (${fixed(1000 / rate, 1)} ms),` : '';
  return `Make the lamp visible: expose for longer${whole} open the aperture, turn the camera to it, darken the room.`;
}

/** What to do about a fault: as the daemon says, but where it is the lamp that is missing. */
export function remedyOf(fault: Fault, cameras: CameraStatus[]): string {
  if (fault.kind !== 'NOT_ALIGNED' || !lampHidden(fault.what)) return fault.remedy;
  return `${lampAdvice(cameras.find(camera => fault.what.includes(camera.id)) ?? cameras[0])} Enlarge a camera to see how bright it is.`;
}

/** Whether the daemon says that this camera doesn't see the lamp. */
export function lampMissing(camera: CameraStatus, faults: Fault[]): boolean {
  const ofThis = (fault: Fault): boolean => !fault.over && fault.kind === 'NOT_ALIGNED' && lampHidden(fault.what) && fault.what.includes(camera.id);
  return camera.state === 'FILMING' && (lampHidden(camera.reason) || faults.some(ofThis));
}
