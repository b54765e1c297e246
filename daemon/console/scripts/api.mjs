// SPDX-License-Identifier: Apache-2.0
// Writes src/api.gen.ts from the .proto files: the types of everything on the wire, and for each message a table by which
// src/wire.ts reads protobuf's JSON (where defaults are left out and 64-bit numbers are strings). So the page can't drift
// from the daemon: a field that is renamed there doesn't compile here. Knows the proto3 that those files use, no more.
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';

const folder = new URL('../../../proto/emberlock/v1/', import.meta.url);
const scalars = {
  double: 'number', float: 'number', int32: 'number', uint32: 'number', int64: 'number', uint64: 'number',
  bool: 'boolean', string: 'string', bytes: 'string',
};
const messages = new Map(); // "CameraStream.Sensor" -> fields
const enums = new Map();
const rpcs = [];

function parse(text) {
  const words = text.replace(/\/\/.*$/gm, '').match(/"[^"]*"|[\w.]+|[{}()=;]/g);
  let at = 0;
  const next = () => words[at++];
  const skipTo = end => { while (next() !== end); };

  function message(name) {
    const fields = [];
    messages.set(name, fields);
    next(); // {
    for (let word = next(); word !== '}'; word = next()) {
      if (word === 'message') message(`${name}.${next()}`);
      else if (word === 'enum') enumeration(`${name}.${next()}`);
      else if (word === 'reserved') skipTo(';');
      else if (word === 'oneof') { next(); next(); for (let type = next(); type !== '}'; type = next()) { field(type, 'optional'); } }
      else if (word === 'repeated' || word === 'optional') field(next(), word);
      else field(word, '');
    }
    function field(type, label) {
      fields.push({name: next(), type, label, scope: name});
      skipTo(';');
    }
  }
  function enumeration(name) {
    const values = [];
    enums.set(name, values);
    next();
    for (let word = next(); word !== '}'; word = next()) {
      values.push(word);
      skipTo(';');
    }
  }
  while (at < words.length) {
    const word = next();
    if (word === 'message') message(next());
    else if (word === 'enum') enumeration(next());
    else if (word === 'service') {
      const service = next();
      next();
      for (let inner = next(); inner !== '}'; inner = next()) {
        const method = next();
        next(); const request = next(); next(); next(); next();
        let response = next();
        const stream = response === 'stream';
        if (stream) response = next();
        next();
        skipTo(';');
        rpcs.push({path: `${service}/${method}`, request, response, stream});
      }
    } else skipTo(';');
  }
}

// A type's full name, as seen from inside `scope`.
function resolve(type, scope) {
  for (let outer = scope.split('.'); ; outer.pop()) {
    const name = [...outer, type].join('.');
    if (messages.has(name) || enums.has(name)) return name;
    if (outer.length === 0) throw new Error(`${scope}: unknown type ${type}`);
  }
}
const identifier = name => name.replaceAll('.', '_');

for (const file of ['session', 'jobs', 'status', 'services']) parse(readFileSync(new URL(`${file}.proto`, folder), 'utf8'));
messages.delete('Event'); // a recording's, which never comes here; only alignment.proto has its parts

const lines = ['// Written by scripts/api.mjs from proto/emberlock/v1. Changes belong there.'];
for (const [name, values] of enums) lines.push(`export type ${identifier(name)} = ${values.map(v => `'${v}'`).join(' | ')};`);
const table = [];
for (const [name, fields] of messages) {
  lines.push(`export interface ${identifier(name)} {`);
  const row = [];
  for (const {name: field, type, label, scope} of fields) {
    const full = type in scalars ? undefined : resolve(type, scope);
    const many = label === 'repeated';
    const optional = label === 'optional' || (full !== undefined && messages.has(full) && !many);
    lines.push(`  ${field}${optional ? '?' : ''}: ${full ? identifier(full) : scalars[type]}${many ? '[]' : ''};`);
    const kind = full === undefined ? scalars[type] : messages.has(full) ? identifier(full) : enums.get(full)[0];
    row.push(`${field}: ['${full !== undefined && enums.has(full) ? 'enum' : full ? 'message' : 'scalar'}', '${kind}', '${many ? 'many' : optional ? 'optional' : 'one'}']`);
  }
  lines.push('}');
  table.push(`  ${identifier(name)}: {${row.join(', ')}},`);
}
lines.push('export type Field = readonly [of: string, type: string, label: string];');
lines.push('export const fields: Record<string, Record<string, Field>> = {', ...table, '};');
lines.push('/** Method: [request, response]. */', 'export interface Calls {');
for (const {path, request, response, stream} of rpcs) if (!stream) lines.push(`  '${path}': [Partial<${request}>, ${response}];`);
lines.push('}', '/** Those that tell how far they are. */', 'export interface Streams {');
for (const {path, request, response, stream} of rpcs) if (stream) lines.push(`  '${path}': [Partial<${request}>, ${response}];`);
lines.push('}', 'export const responses: Record<keyof Calls | keyof Streams, string> = {');
for (const {path, response} of rpcs) lines.push(`  '${path}': '${response}',`);
lines.push('};', '');
mkdirSync(new URL('../src/', import.meta.url), {recursive: true});
writeFileSync(new URL('../src/api.gen.ts', import.meta.url), lines.join('\n'));
