// SPDX-License-Identifier: Apache-2.0
// Recording: one big button, and what the recording loses or doesn't.
import type {Counts, DaemonStatus, RecordingStatus} from './api.gen';
import {act, TwoStep} from './act';
import {el, set, setText, show} from './dom';
import {bytes, clock, count, fixed, known, percent, short, span} from './format';
import {Parts} from './hosts';
import {LiveChoice} from './live_volumes';
import {call} from './wire';

const causes: [keyof Counts, string][] = [
  ['camera_gap', 'never arrived'], ['transport', 'lost on the bus'], ['underrun', 'no buffer'], ['queue', 'found the queue full'], ['disk', 'disk refused'],
];

/** Frames of a recording that are gone, by cause, most first; empty: none. */
export function drops(counts: Counts | undefined): [string, number][] {
  return causes.map(([cause, words]): [string, number] => [words, counts?.[cause] ?? 0]).filter(([, lost]) => lost > 0).sort((a, b) => b[1] - a[1]);
}

/** What a power cut now would take: frames that are on their way to the disk, and since when. */
export function atRisk(r: RecordingStatus): string {
  const frames = (r.progress?.queued ?? 0) + (r.progress?.written ?? 0) - (r.progress?.safe ?? 0);
  return frames > 0 ? `${count(frames)}, ${fixed(r.progress?.at_risk_s ?? 0, 1)} s` : 'none';
}

/** How long a take may be that begins now, or for how long one that runs is sure: "A take may be 42 s long, most likely 3 min 20 s." */
export function takeWords(status: DaemonStatus): string {
  const a = status.alignment;
  if (a?.verdict !== 'ALIGNED' || !known(a.time_left_s)) return '';
  const running = status.phase === 'CAPTURING';
  if (a.time_left_s <= 0) return running ? `${a.leaves_first} may have left tolerance.` : 'The lock is being checked.';
  const likely = known(a.likely_left_s) && a.likely_left_s > 1.1 * a.time_left_s ? `, most likely ${span(a.likely_left_s)}` : '';
  return running ? `The lock holds for another ${span(a.time_left_s)}${likely}.` : `A take may be ${span(a.time_left_s)} long${likely}.`;
}

export class Record {
  readonly button = el('button', {class: 'record', type: 'button', 'aria-keyshortcuts': 'R'});
  readonly hint = el('p', {class: 'note hint', role: 'status'});
  private readonly time = el('output', {class: 'clock'}, '0:00.0');
  private readonly session = el('p', {class: 'session'});
  private readonly numbers = el('dl', {class: 'numbers'});
  private readonly queue = el('meter', {min: 0, max: 1, low: 0.5, high: 0.8, optimum: 0, 'aria-label': 'Fullest queue'});
  private readonly queueWords = el('span');
  private readonly drops = el('p', {class: 'drops'});
  private readonly disk = el('p', {class: 'disk'});
  private readonly parts = new Parts();
  private readonly verdict = el('p', {class: 'verdict', role: 'status'});
  private readonly name = el('input', {name: 'name', maxlength: 80, placeholder: 'by time', autocomplete: 'off', spellcheck: false,
                                       dir: 'auto', pattern: '([\\p{L}\\p{N}_:][\\p{L}\\p{M}\\p{N} ._:\\u200c\\u200d\\-]*)?',
                                       title: 'Letters of any script, digits, space and . _ : -, a letter or digit in front'});
  private readonly purpose = el('select', {name: 'purpose'}, el('option', {value: 'flame'}, 'flame'), el('option', {value: 'alignment'}, 'alignment'));
  private readonly seconds = el('input', {name: 'seconds', type: 'number', min: 0, step: 'any', placeholder: 'until stopped', inputmode: 'decimal'});
  private readonly reconstruct = el('input', {name: 'reconstruct', type: 'checkbox'});
  private readonly live = new LiveChoice();
  private readonly step = new TwoStep(this.button, armed => this.words(armed), () => this.go());
  private status?: DaemonStatus;
  private waiting = false;
  private renewed = 0;  // seconds for which the lock was renewed: the next press records
  readonly root: HTMLElement;

  constructor() {
    this.button.addEventListener('click', () => this.press('button'));
    const option = (label: string, input: HTMLElement) => el('label', {}, el('span', {}, label), input);
    this.root = el('section', {id: 'record', class: 'panel', 'aria-labelledby': 'record-title'},
      el('h2', {id: 'record-title', class: 'hidden'}, 'Recording'),
      el('div', {class: 'record-line'}, this.button, el('div', {}, this.time, this.session)), this.hint,
      this.disk, this.numbers, el('div', {class: 'queue'}, el('span', {}, 'queue'), this.queue, this.queueWords), this.drops, this.parts.root, this.verdict,
      el('details', {}, el('summary', {}, 'Name and length, live volumes'),
        el('div', {class: 'options'}, option('Name', this.name), option('Of', this.purpose), option('Seconds', this.seconds),
          option('Reconstruct it afterwards', this.reconstruct), ...this.live.options)));
  }

  /** By key everything takes two presses. By the button a start takes one when the cameras are locked; all else two. */
  press(by: 'key' | 'button'): void {
    if (this.button.disabled) return;
    if (by === 'button' && this.status?.phase === 'LOCKED' && !this.step.armed) this.go();
    else this.step.press();
    this.showHint();
  }

  show(status: DaemonStatus): void {
    const before = this.status?.phase;
    this.status = status;
    if (before !== status.phase && this.step.armed) this.step.disarm();
    const recording = status.recording;
    const phase = status.phase;
    this.button.disabled = this.waiting || phase === 'FINISHING' || phase === 'CALIBRATING' || phase === 'ALIGNING' || phase === 'PHASE_UNSPECIFIED';
    set(this.button, 'data-recording', phase === 'CAPTURING');
    this.step.show();
    this.showHint();
    this.showDisk(status);
    for (const part of [this.numbers, this.queue.parentElement!, this.drops]) show(part, recording !== undefined);
    setText(this.time, clock(recording?.seconds ?? 0));
    setText(this.session, recording?.session ?? '');
    set(this.root, 'data-recording', recording?.state);
    show(this.verdict, recording?.state === 'COMPLETE' || recording?.state === 'FAILED');
    this.parts.show(recording);
    if (recording) this.showRecording(recording);
  }

  private words(armed: boolean): string {
    if (this.waiting) return '…';
    if (this.status?.phase === 'CAPTURING') return armed ? 'Press again: stop' : 'Stop';
    if (this.status?.phase === 'FINISHING') return 'Finishing';
    if (armed) return this.status?.phase === 'LOCKED' ? 'Press again: record' : 'Press again: record unlocked';
    return 'Record';
  }

  private showHint(): void {
    const phase = this.status?.phase;
    setText(this.hint, this.step.armed ? (phase === 'IDLE' ? 'The cameras are not locked: their frames will not be of the same instants.' : 'Within 5 seconds, or nothing happens.')
            : phase === 'IDLE' ? 'Not locked: recording needs a second press.'
            : phase === 'ALIGNING' || phase === 'CALIBRATING' ? 'After the alignment, or when it is stopped.'
            : this.status && (phase === 'LOCKED' || phase === 'CAPTURING') ? [this.renewed > 0 && `The lock was to end within ${span(this.renewed)} and is renewed: press again.`, takeWords(this.status)].filter(Boolean).join(' ') : '');
  }

  private showDisk(status: DaemonStatus): void {
    const s = status.storage;
    set(this.disk, 'data-light', !s ? 'LIGHT_UNSPECIFIED' : s.minutes_left < 2 ? 'RED' : s.minutes_left < 10 ? 'AMBER' : 'GREEN');
    setText(this.disk, s ? `Disk: ${s.minutes_left >= 120 ? `${fixed(s.minutes_left / 60, 1)} h` : `${fixed(s.minutes_left, s.minutes_left < 10 ? 1 : 0)} min`} left, ${bytes(s.free_bytes)} free` : '');
  }

  private showRecording(r: RecordingStatus): void {
    const list: [string, string][] = [
      ['frames safe', count(r.frames)],
      ['arrived', count(r.progress?.arrived ?? r.frames)],
      ['not yet safe', atRisk(r)],
      ['written', bytes(r.bytes)],
      ['rate', `${fixed(r.bytes_per_s / 1e6, 1)} MB/s`],
      ['spread', short(r.spread_s)],
    ];
    if (r.transcoded !== undefined && r.transcoded < 1) list.push(['compressed', percent(r.transcoded)]);
    while (this.numbers.children.length > list.length) this.numbers.lastElementChild!.remove();
    while (this.numbers.children.length < list.length) this.numbers.append(el('div', {}, el('dt'), el('dd')));
    list.forEach(([name, value], place) => {
      setText(this.numbers.children[place]!.children[0]!, name);
      setText(this.numbers.children[place]!.children[1]!, value);
    });
    this.queue.value = r.queue_fill;
    setText(this.queueWords, percent(r.queue_fill));
    const lost = drops(r.lost);
    set(this.drops, 'data-bad', lost.length > 0);
    setText(this.drops, lost.length === 0 ? `No frame lost${r.hosts.length > 0 ? ' here' : ''}` : `Lost${r.hosts.length > 0 ? ' here' : ''}: ${lost.map(([cause, frames]) => `${count(frames)} ${cause}`).join(', ')}`);
    set(this.verdict, 'data-verdict', r.state);
    setText(this.verdict, r.verdict);
  }

  private go(): void {
    const stop = this.status?.phase === 'CAPTURING';
    if (!stop && !this.name.checkValidity()) {
      this.name.closest('details')!.open = true;
      this.name.reportValidity();
      return;
    }
    const live = this.live.request();
    if (!stop && !live) return;
    this.waiting = true;
    this.button.disabled = true;
    this.step.show();
    const seconds = this.seconds.valueAsNumber || 0;
    const left = this.status?.alignment?.time_left_s;
    if (!stop && this.status?.phase === 'LOCKED' && known(left) && seconds > left && this.renewed !== seconds) {
      void act<unknown>(call('Sync/Align', {renew: true, hold_s: seconds})).then(answer => {
        this.waiting = false;
        this.renewed = answer ? seconds : 0;
        if (this.status) this.show(this.status);
      });
      return;
    }
    this.renewed = 0;
    void act<unknown>(stop ? call('Capture/Stop') : call('Capture/Record', {
      name: this.name.value.trim(),
      purpose: this.purpose.value,
      seconds,
      unlocked: this.status?.phase !== 'LOCKED',
      reconstruct: this.reconstruct.checked,
      ...live,
    })).then(answer => {
      this.waiting = false;
      if (answer && !stop) this.name.value = '';
      if (this.status) this.show(this.status);
    });
  }
}
