// SPDX-License-Identifier: Apache-2.0
// Aligning: orders, how far it is, every camera's error against time, what it cost, and what could be met instead.
import type {AlignmentCost, AlignmentOffer, AlignmentStatus, DaemonStatus} from './api.gen';
import {act, TwoStep} from './act';
import {el, set, setText, show} from './dom';
import {count, fixed, known, plural, short, span, tolerance as toleranceWords} from './format';
import {Plot} from './plot';
import {call} from './wire';

const verdicts = {VERDICT_UNSPECIFIED: '', GO_ON: 'going on', ALIGNED: 'aligned', REFUSED: 'refused', GIVEN_UP: 'given up'};
const policies = ['', 'fixed-reference', 'densest', 'timed', 'trimmed'];

/** "12 resets in 40 s (95 %: 20 in 1 min 10 s)". */
export function costWords(cost: AlignmentCost): string {
  return `${plural(Math.round(cost.resets), 'reset')} in ${span(cost.time_s)} (95 %: ${count(cost.resets_p95)} in ${span(cost.time_p95_s)})`;
}

export class Alignment {
  private readonly tolerance = el('input', {id: 'tolerance', name: 'tolerance', size: 9, placeholder: 'default', spellcheck: false, autocomplete: 'off',
                                            'aria-describedby': 'tolerance-help'});
  private readonly speed = el('input', {name: 'flame_speed', type: 'number', min: 0.001, step: 'any', inputmode: 'decimal', placeholder: 'm/s'});
  private readonly detail = el('input', {name: 'detail', type: 'number', min: 0.001, step: 'any', inputmode: 'decimal', placeholder: 'mm'});
  private readonly flame = el('p', {class: 'note flame'});
  private readonly policy = el('select', {id: 'policy', name: 'policy'}, ...policies.map(name => el('option', {value: name}, name || 'default')));
  private readonly start = el('button', {class: 'primary', type: 'submit'}, 'Align');
  readonly stop = el('button', {class: 'quiet stop', type: 'button', onclick: () => this.stopping.press()}, 'Stop');
  private readonly stopping = new TwoStep(this.stop, armed => (armed ? 'Press again to stop' : 'Stop'), () => void act(call('Sync/Stop')));
  private readonly verdict = el('p', {class: 'verdict', role: 'status'});
  private readonly numbers = el('dl', {class: 'numbers'});
  private readonly cost = el('p', {class: 'note'});
  private readonly offers = el('div', {class: 'offers', hidden: true});
  private readonly plot = new Plot('Error of every camera against time');
  private shownOffers = '';
  private shownHistory = '';
  readonly root: HTMLElement;

  constructor() {
    const form = el('form', {class: 'orders', onsubmit: (event: Event) => { event.preventDefault(); this.align({}); }},
      el('label', {}, el('span', {}, 'Tolerance'), this.tolerance), el('label', {}, el('span', {}, 'Policy'), this.policy), this.start, this.stop,
      el('span', {id: 'tolerance-help', class: 'hidden'}, 'For example 0.5ms or 10rows; empty: as configured, else as the flame needs it'),
      el('details', {}, el('summary', {}, 'The flame'),
        el('div', {class: 'options'}, el('label', {}, el('span', {}, 'Fastest motion, m/s'), this.speed), el('label', {}, el('span', {}, 'Smallest detail, mm'), this.detail)), this.flame));
    this.root = el('section', {id: 'alignment', class: 'panel', 'aria-labelledby': 'alignment-title'},
      el('h2', {id: 'alignment-title'}, 'Alignment'), form, this.verdict, this.offers, this.numbers, this.plot.root, this.cost);
    show(this.plot.root, false);
  }

  show(status: DaemonStatus): void {
    const busy = status.phase === 'CAPTURING' || status.phase === 'FINISHING';
    const running = status.phase === 'CALIBRATING' || status.phase === 'ALIGNING';
    this.start.disabled = busy || running;
    setText(this.start, status.phase === 'LOCKED' ? 'Align anew' : 'Align');
    this.stop.disabled = !(running || status.phase === 'LOCKED');
    if (this.stop.disabled && this.stopping.armed) this.stopping.disarm();
    const a = status.alignment;
    if (!a) {
      setText(this.verdict, 'Not aligned since the start.');
      return;
    }
    set(this.verdict, 'data-verdict', a.verdict);
    setText(this.verdict, [verdicts[a.verdict] && `${verdicts[a.verdict][0]!.toUpperCase()}${verdicts[a.verdict].slice(1)}.`, a.reason].filter(Boolean).join(' '));
    this.tolerance.placeholder = a.flame_speed_m_s > 0 ? `${fixed(a.tolerance_s * 1e3, 2)} ms` : '';
    if (a.flame_speed_m_s > 0) {
      this.speed.placeholder = `${a.flame_speed_m_s}`;
      this.detail.placeholder = `${1000 * a.detail_m}`;
    }
    setText(this.flame, a.flame_speed_m_s > 0 ? `At ${a.flame_speed_m_s} m/s, two cameras ${short(2 * a.tolerance_s)} apart see ${fixed(1000 * a.detail_m, 1)} mm displaced by half.` : '');
    this.showNumbers(a);
    this.showOffers(a, this.start.disabled);
    setText(this.cost, a.cost ? `Foretold: ${costWords(a.cost)}` : '');
    this.showHistory(a, status.cameras.map(camera => camera.id));
  }

  /** What the keyboard does: aligns, or arms the stop. */
  key(): void {
    if (!this.start.disabled && this.stop.disabled) this.align({});
    else if (!this.stop.disabled) this.stopping.press();
  }

  private align(request: {tolerance?: string; policy?: string; anyway?: boolean}): void {
    const tolerance = this.tolerance.value.trim();
    void act(call('Sync/Align', {
      tolerance: request.tolerance ?? (/^\d+(\.\d+)?$/.test(tolerance) ? `${tolerance}ms` : tolerance.replaceAll(' ', '')),
      policy: request.policy ?? this.policy.value,
      anyway: request.anyway ?? false,
      ...(request.tolerance || tolerance ? {} : {flame_speed_m_s: this.speed.valueAsNumber || 0, detail_m: (this.detail.valueAsNumber || 0) / 1000}),
    }));
  }

  private showNumbers(a: AlignmentStatus): void {
    const list: [string, string][] = [
      ['tolerance ±', toleranceWords(a.tolerance_s, a.tolerance_rows)],
      ['policy', a.policy || '–'],
      ['round', count(a.round)],
      ['resets', count(a.resets)],
      ['worst pair', known(a.worst_pair_s) ? short(a.worst_pair_s) : '–'],
      ['checks', count(a.checks)],
      ['next check in', span(a.next_check_s)],
      ['time left', span(a.time_left_s)],
      ['most likely', span(a.likely_left_s)],
    ];
    while (this.numbers.children.length < list.length) this.numbers.append(el('div', {}, el('dt'), el('dd')));
    list.forEach(([name, value], place) => {
      const [dt, dd] = this.numbers.children[place]!.children;
      setText(dt!, name);
      setText(dd!, value);
    });
  }

  private showOffers(a: AlignmentStatus, disabled: boolean): void {
    show(this.offers, a.verdict === 'REFUSED' || a.verdict === 'GIVEN_UP');
    const key = JSON.stringify([a.offers, disabled]);
    if (key === this.shownOffers) return;
    this.shownOffers = key;
    this.offers.replaceChildren(
      el('p', {}, a.offers.length > 0 ? 'What can be met:' : 'Nothing else can be offered.'),
      ...a.offers.map(offer => this.offer(offer, disabled)),
      el('button', {class: 'quiet', type: 'button', disabled, onclick: () => this.align({anyway: true})}, 'Try it anyway'));
  }

  private offer(offer: AlignmentOffer, disabled: boolean): HTMLElement {
    return el('button', {type: 'button', class: 'offer', disabled,
                         onclick: () => this.align({tolerance: `${offer.tolerance_rows}rows`, policy: offer.policy})},
      el('strong', {}, `± ${toleranceWords(offer.tolerance_s, offer.tolerance_rows)}, ${offer.policy}`), el('span', {}, offer.cost ? costWords(offer.cost) : ''));
  }

  private showHistory(a: AlignmentStatus, cameras: string[]): void {
    const last = a.history.at(-1);
    const key = `${a.history.length} ${last?.round} ${last?.at_s} ${a.tolerance_rows} ${cameras.join()}`;
    if (key === this.shownHistory) return;
    this.shownHistory = key;
    show(this.plot.root, a.history.length > 0);
    const finite = (value: number | undefined) => (known(value) ? value : null);
    this.plot.show({x: 'seconds since it began', y: 'error, rows', lines: cameras.map(name => ({name})), linear: a.tolerance_rows || 100,
                    band: a.tolerance_rows, tick: value => fixed(value, 0)},
                   [a.history.map(point => point.at_s), ...cameras.map((_, place) => a.history.map(point => finite(point.error_rows[place])))]);
  }
}
