// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/sign_in_page.h"

#include <string_view>

#include <fmt/format.h>

namespace emberlock::daemon {
namespace {

constexpr std::string_view kPage = R"(<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="dark">
<title>Emberlock: not let in</title>
<style>
body {{ max-width: 34rem; margin: 12vh auto; padding: 0 1.5rem; background: #0a0c10; color: #e6e9ef; font: 1.1rem/1.5 system-ui, sans-serif; }}
h1 {{ font-size: 1.5rem; }}
code, input {{ font-family: ui-monospace, monospace; background: #171b22; color: inherit; border: 1px solid #3a424f; border-radius: 4px; padding: .2rem .5rem; }}
pre code {{ display: block; padding: .7rem 1rem; font-size: 1.2rem; }}
button {{ font: inherit; padding: .2rem .9rem; }}
[role=alert] {{ border-left: 4px solid #e69f00; padding-left: 1rem; }}
</style>
</head>
<body>
<h1>Emberlock lets this browser in by a link</h1>
{}<p>On the machine that the cameras are connected to, type</p>
<pre><code>emberlock console</code></pre>
<p>and open the link that it prints. It opens once, within two minutes; then this browser stays let in.</p>
<p>If it says that you may not use the daemon's socket, join its group: <code>sudo usermod -aG emberlock $USER</code>, and log in again.</p>
{}</body>
</html>
)";

constexpr std::string_view kForm = R"(<form method="post" action="/open">
<p><label>Or give the daemon's token: <input type="password" name="token" autocomplete="current-password" required></label>
<button>Open</button></p>
</form>
)";

std::string_view alert_for(Refusal refusal) {
  switch (refusal) {
    case Refusal::wrong_link:
      return "<p role=\"alert\">This link was opened already, or is older than two minutes. Ask for "
             "another.</p>\n";
    case Refusal::wrong_token:
      return "<p role=\"alert\">That is not the token.</p>\n";
    case Refusal::unknown_session:
      return "<p role=\"alert\">This browser was let in before, but the daemon has started anew since, or "
             "that was long ago.</p>\n";
    default:
      return "";
  }
}

}  // namespace

std::string sign_in_page(Refusal refusal, TokenField field) {
  return fmt::format(kPage, alert_for(refusal), field == TokenField::shown ? kForm : "");
}

}  // namespace emberlock::daemon
