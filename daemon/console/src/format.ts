// SPDX-License-Identifier: Apache-2.0
// Numbers as an operator reads them: no more digits than matter, always the unit, a true minus sign.

const kNone = '–';

export function fixed(value: number, digits: number): string {
  return value.toFixed(digits).replace('-', '−');
}

function signed(value: number, digits: number): string {
  const text = fixed(Math.abs(value), digits);
  return Number(text) === 0 ? text : (value < 0 ? '−' : '+') + text;
}

/** Digits after the point so that about three are shown. */
function digits(value: number): number {
  const size = Math.abs(value);
  return size >= 99.5 ? 0 : size >= 9.95 ? 1 : 2;
}

/** A measured value as a scale names it: "1400", "40.0", "0.50", "0.012". */
export function reading(value: number): string {
  if (value === 0) return '0';
  return Math.abs(value) < 0.1 ? value.toPrecision(2).replaceAll('-', '−') : fixed(value, digits(value));
}

export function rows(value: number | undefined): string {
  return known(value) ? `${signed(value, Math.abs(value) >= 99.5 ? 0 : 1)} rows` : kNone;
}

/** An offset as one compares it between cameras, in one unit: "−13 834 µs". */
export function micros(seconds: number | undefined): string {
  if (!known(seconds)) return kNone;
  const whole = Math.round(seconds * 1e6);
  return `${whole < 0 ? '−' : whole > 0 ? '+' : ''}${count(Math.abs(whole))} µs`;
}

/** A short time: "20 µs", "−5.40 ms". */
export function short(seconds: number | undefined): string {
  if (!known(seconds)) return kNone;
  const size = Math.abs(seconds);
  const [scale, unit] = size < 0.9995e-3 ? [1e6, 'µs'] : size < 0.9995 ? [1e3, 'ms'] : [1, 's'];
  const value = seconds * scale;
  return `${signed(value, unit === 'µs' ? 0 : digits(value)).replace('+', '')} ${unit}`;
}

/** A tolerance as flames and as people see it: "0.50 ms (9.3 rows)". */
export function tolerance(seconds: number, inRows: number): string {
  return `${short(seconds)} (${fixed(inRows, inRows < 99.5 ? 1 : 0)} rows)`;
}

/** A length of time that one waits for: "48 s", "3 min 20 s", "2 h 05 min". */
export function span(seconds: number | undefined): string {
  if (!known(seconds)) return kNone;
  if (seconds < 0) return '0 s';
  if (seconds < 9.95) return `${fixed(seconds, 1)} s`;
  const whole = Math.round(seconds);
  if (whole < 120) return `${whole} s`;
  if (whole < 7200) return `${Math.floor(whole / 60)} min ${String(whole % 60).padStart(2, '0')} s`;
  return `${Math.floor(whole / 3600)} h ${String(Math.floor((whole % 3600) / 60)).padStart(2, '0')} min`;
}

/** As a clock runs: "0:07.3", "12:41.0". */
export function clock(seconds: number): string {
  const tenths = Math.floor(Math.max(0, seconds) * 10);
  return `${Math.floor(tenths / 600)}:${String(Math.floor(tenths / 10) % 60).padStart(2, '0')}.${tenths % 10}`;
}

export function ppm(value: number | undefined): string {
  return known(value) ? `${signed(value, Math.abs(value) >= 99.5 ? 0 : 1)} ppm` : kNone;
}

/** Bytes, decimal: "15.2 GB". */
export function bytes(value: number): string {
  let unit = 0;
  const units = ['B', 'kB', 'MB', 'GB', 'TB', 'PB'];
  while (value >= 999.5 && unit < units.length - 1) {
    value /= 1000;
    ++unit;
  }
  return `${fixed(value, unit === 0 ? 0 : digits(value))} ${units[unit]}`;
}

export function count(value: number): string {
  return Math.round(value).toLocaleString('en').replaceAll(',', ' ');
}

export function percent(fraction: number): string {
  return `${Math.round(100 * fraction)} %`;
}

export function plural(value: number, one: string, many = `${one}s`): string {
  return `${count(value)} ${value === 1 ? one : many}`;
}

/** With a capital and a full stop, as the daemon writes what it shows. A first word that is a name ("cam-2") stays as it is. */
export function sentence(text: string): string {
  const begun = /^[a-z',]+( |$)/.test(text) ? text[0]!.toUpperCase() + text.slice(1) : text;
  return begun.replace(/[^.!?]$/, '$&.');
}

/** "2026-11-22T02:50:00.123Z" as the local time of day. */
export function timeOfDay(utc: string): string {
  const time = new Date(utc);
  return Number.isNaN(time.getTime()) ? utc : time.toLocaleTimeString('en-GB');
}

export function dateAndTime(utc: string): string {
  const time = new Date(utc);
  return Number.isNaN(time.getTime()) ? utc : `${time.toLocaleDateString('en-CA')} ${time.toLocaleTimeString('en-GB')}`;
}

export function known(value: number | undefined): value is number {
  return value !== undefined && Number.isFinite(value);
}
