// SPDX-License-Identifier: Apache-2.0
#include "apply/edit_file.h"

#include <cstdlib>
#include <string_view>
#include <variant>

#include "tests/fuzz/target.h"

// An edit file: what is read from it can be written and read again as the same, and stands; what can't has an
// error that says where. A step of somebody who may name no files names none.
FUZZ_TARGET(edit_file) {
  using namespace emberlock;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto foreign = apply::parse_foreign_operation(bytes, "fuzz", apply::GivenPictures{"given.png"});
  const auto* const object = foreign ? std::get_if<apply::ObjectEdit>(&*foreign) : nullptr;
  if (object != nullptr && (object->file != "given.png" || object->mask)) std::abort();
  const auto edits = apply::parse_edits(bytes, "fuzz.json", "");
  if (!edits) {
    if (edits.error().where.empty() || edits.error().kind != ErrorKind::bad_input) std::abort();
    return 0;
  }
  if (!apply::history_of(edits->steps)) std::abort();
  const std::string text = apply::to_json(*edits);
  const auto again = apply::parse_edits(text, "again.json", "");
  if (!again || apply::to_json(*again) != text) std::abort();
  return 0;
}
