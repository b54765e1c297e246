// SPDX-License-Identifier: Apache-2.0
// A stylization as the daemon would tell it: takes steps, and shows a preview after each.
import type {EditRequest, StylizationStatus, StylizationStatus_View as View} from '../../../daemon/console/src/api.gen';
import {type Mock, Refusal} from './mock';
import {flameVolume} from './pictures';
import {locked, reconstruction} from './scene';

/** Eleven cameras around the flame of flameVolume(), the last of them held out. */
export const kViews: View[] = Array.from({length: 11}, (_, at) => {
  const [c, s] = [Math.cos(2 * Math.PI * at / 11), Math.sin(2 * Math.PI * at / 11)];
  // From a metre away towards the volume's middle, upwards in z; 1000 pixels focal length.
  const rows = [[-s, c, 0, 0], [0, 0, -1, 0.2], [-c, -s, 0, 1]];
  const [u, v, w] = rows as [number[], number[], number[]];
  return {name: `virtual-${String(at).padStart(2, '0')}`, width: 640, height: 480, held_out: at === 10,
          pixel_from_world: [...u.map((value, i) => 1000 * value + 320 * w[i]!), ...v.map((value, i) => 1000 * value + 240 * w[i]!), ...w]};
});

export class StylizedFlame {
  status: StylizationStatus = {views: kViews, view: 'virtual-00', passes: 0, residual: 0, steps: 0, undone: 0, pauses: true};
  /** What was asked, with its operation read. */
  readonly steps: {op: string; [key: string]: unknown}[] = [];

  constructor(private readonly mock: Mock, private readonly pictures: Uint8Array[]) {
    mock.status = {...locked(), reconstruction: reconstruction(12, {id: 'e1', doing: 'waits for a step', fraction: 1, stylization: this.status})};
    mock.answers['Reconstruct/Edit'] = request => this.edit(request);
  }

  /** The next preview. */
  preview(): void {
    const {views: _, ...stylization} = this.status;
    this.mock.tell({iteration: {reconstruction: 'e1', camera_id: this.status.view, stylization, iteration: {iteration: 12 + this.status.passes, seconds: 48 + this.status.passes / 50, input_rmse: 3}}});
    const header = {reconstruction: 'e1', iteration: 12 + this.status.passes, camera_id: this.status.view};
    this.mock.tellBytes({kind: 'captured', ...header}, this.pictures[0]!);
    this.mock.tellBytes({kind: 'rendered', ...header}, this.pictures[Math.min(1 + this.status.steps, this.pictures.length - 1)]!);
    const {header: volume, bytes} = flameVolume();
    this.mock.tellBytes(volume, bytes);
  }

  private edit({operation, view}: Partial<EditRequest>): StylizationStatus {
    if (view) this.status = {...this.status, view};
    if (operation) this.take(JSON.parse(operation) as {op: string});
    const answer = this.status;
    setTimeout(() => {
      if (operation) this.status = {...this.status, passes: this.status.passes + 1, residual: 3.41};
      this.preview();
    }, 20);
    return answer;
  }

  private take(step: {op: string}): void {
    this.steps.push(step);
    const {steps, undone} = this.status;
    const change = step.op === 'undo' ? -1 : 1;
    if (steps + change < 0) throw new Refusal(400, 'INVALID_ARGUMENT', 'steps[0]: there is nothing to undo. Leave it away.');
    if ((step as {radius?: number}).radius === 9999) throw new Refusal(400, 'INVALID_ARGUMENT', 'step: view: "virtual-10" is held out. Give one of virtual-00, virtual-01.');
    this.status = {...this.status, steps: steps + change, undone: step.op === 'undo' ? undone + 1 : step.op === 'redo' ? undone - 1 : 0, pauses: false};
  }
}
