// SPDX-License-Identifier: Apache-2.0
// A sequence of frames that are reconstructed: how many are done, and which failed.
import type {ReconstructionStatus, SequenceFrame} from './api.gen';
import {el, Keyed, setText, show} from './dom';
import {count} from './format';

const kNamed = 8;  // of those that failed

/** The frame at hand: the last that was begun. */
export function frameAtHand(status: ReconstructionStatus): number | undefined {
  return status.frames.filter(({state}) => state !== 'STATE_UNSPECIFIED').at(-1)?.frame;
}

/** "12 of 40 done, 1 failed". */
export function tally(frames: readonly SequenceFrame[]): string {
  const many = (state: SequenceFrame['state']) => frames.filter(frame => frame.state === state).length;
  const failed = many('FAILED');
  return `${count(many('DONE'))} of ${count(frames.length)} done${failed > 0 ? `, ${count(failed)} failed` : ''}`;
}

export class Sequence {
  private readonly tally = el('p', {class: 'tally'});
  private readonly list = el('ul', {class: 'reasons'});
  private readonly more = el('p', {class: 'note'});
  private readonly failed = new Keyed<SequenceFrame, {root: HTMLElement}>(this.list, () => ({root: el('li')}),
    (item, {frame, error}) => setText(item.root, `frame ${frame}: ${error}`));
  readonly root = el('div', {class: 'sequence', hidden: true}, this.tally, this.list, this.more);

  show(frames: readonly SequenceFrame[]): void {
    show(this.root, frames.length > 0);
    setText(this.tally, `Frames: ${tally(frames)}`);
    const failed = frames.filter(({state}) => state === 'FAILED');
    this.failed.show(failed.slice(0, kNamed), ({frame}) => String(frame));
    show(this.list, failed.length > 0);
    show(this.more, failed.length > kNamed);
    setText(this.more, `Also failed: ${failed.slice(kNamed).map(({frame}) => frame).join(', ')}`);
  }
}
