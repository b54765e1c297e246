// SPDX-License-Identifier: Apache-2.0
// A state as shape, colour and word together, so that none of them has to be seen.
import type {CameraStatus, Light, Phase} from './api.gen';
import {set, setText, svg} from './dom';
import {known} from './format';

export const phaseWords: Record<Phase, string> = {
  PHASE_UNSPECIFIED: '…',
  IDLE: 'Idle',
  CALIBRATING: 'Measuring row time',
  ALIGNING: 'Aligning',
  LOCKED: 'Locked',
  CAPTURING: 'Recording',
  FINISHING: 'Finishing',
};

export const lightWords: Record<Light, string> = {LIGHT_UNSPECIFIED: 'unknown', GREEN: 'good', AMBER: 'look', RED: 'act'};

// Disc, triangle and octagon fill the box about equally.
const shapes: Record<Light, string> = {
  LIGHT_UNSPECIFIED: 'M50 12a38 38 0 1 0 .01 0zm0 14a24 24 0 1 1-.01 0z',
  GREEN: 'M50 6a44 44 0 1 0 .01 0z',
  AMBER: 'M50 4 98 92H2z',
  RED: 'M31 4h38l27 27v38L69 96H31L4 69V31z',
};

/** A sign in the light's shape and colour; what it says stands beside it as text. */
export class Sign {
  private readonly path = svg('path', {d: shapes.LIGHT_UNSPECIFIED});
  readonly root = svg('svg', {viewBox: '0 0 100 100', class: 'sign', 'aria-hidden': 'true', 'data-light': 'LIGHT_UNSPECIFIED'}, this.path);

  constructor(light: Light = 'LIGHT_UNSPECIFIED') {
    this.show(light);
  }

  show(light: Light): void {
    set(this.path, 'd', shapes[light]);
    set(this.root, 'data-light', light);
  }
}

/** "in tolerance", "lost", ...: what a camera's light stands for. The tolerance in seconds, of the alignment. */
export function cameraWord(camera: CameraStatus, tolerance: number | undefined): string {
  switch (camera.state) {
    case 'LOST': return 'lost';
    case 'QUARANTINED': return 'hangs';
    case 'ENDED': return 'over';
    case 'STOPPED': return 'stopped';
    case 'STATE_UNSPECIFIED': return 'unknown';
    case 'FILMING': break;
  }
  if (known(camera.error_s) && known(tolerance)) {
    return Math.abs(camera.error_s) <= tolerance ? 'in tolerance' : 'out of tolerance';
  }
  if (camera.sight !== '' && camera.sight !== 'dot' && camera.sight !== 'known') return camera.sight.replaceAll(/[-_]/g, ' ');
  return camera.light === 'RED' ? 'act' : camera.light === 'AMBER' ? 'look' : 'filming';
}

/** Frames of a camera that were lost in the last seconds, whatever the cause: while there are any its light isn't green. All since the start are
 *  among the facts of the enlarged picture. */
export function lostFrames(camera: CameraStatus): number {
  return camera.lost_lately;
}

export function showSign(sign: Sign, label: Element, light: Light, word: string): void {
  sign.show(light);
  setText(label, word);
}
