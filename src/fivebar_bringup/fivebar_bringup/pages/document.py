"""What every page is: one file with everything in it, which asks nothing of the network."""

from __future__ import annotations

from html import escape

CSS = """
:root { color-scheme: light dark; --ink: #1f2430; --soft: #5b6472; --line: #d9dde4; --page: #f6f7f9; --card: #ffffff;
  --good: #00714f; --bad: #b34700; }
@media (prefers-color-scheme: dark) { :root { --ink: #e7e9ee; --soft: #a4adbb; --line: #363d4a; --page: #14171d;
  --card: #1d222b; --good: #35c496; --bad: #ff9a4d; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink); font: 16px/1.55 system-ui, sans-serif; }
main { max-width: 1060px; margin: 0 auto; padding: 2.2rem 1.2rem 4rem; }
h1 { margin: 0 0 .2rem; font-size: 1.9rem; overflow-wrap: anywhere; }
h2 { margin: 2.6rem 0 .8rem; font-size: 1.25rem; }
.setting { margin: 0; color: var(--soft); }
.verdict { margin: 1.3rem 0 0; padding: .8rem 1.1rem; background: var(--card); border-left: 5px solid var(--good);
  border-radius: 0 8px 8px 0; }
.verdict strong { color: var(--good); }
.failed { border-left-color: var(--bad); }
.failed strong { color: var(--bad); }
.verdict ul { margin: .4rem 0 0; padding-left: 1.2rem; overflow-wrap: anywhere; }
.scroll { overflow-x: auto; background: var(--card); border: 1px solid var(--line); border-radius: 8px; }
table { border-collapse: collapse; width: 100%; }
th, td { padding: .45rem .9rem; text-align: left; vertical-align: top; border-top: 1px solid var(--line); }
thead th { border-top: 0; color: var(--soft); font-weight: 600; }
tbody th { font-weight: 400; }
td { font-variant-numeric: tabular-nums; }
figure { margin: 0 0 2rem; background: var(--card); border: 1px solid var(--line); border-radius: 8px;
  overflow: hidden; }
img { display: block; width: 100%; height: auto; background: #ffffff; }
figcaption { padding: .7rem 1.1rem .9rem; color: var(--soft); font-size: .93rem; }
pre { margin: 0; padding: .9rem 1.1rem; overflow-x: auto; background: var(--card); border: 1px solid var(--line);
  border-radius: 8px; font: .88rem/1.5 ui-monospace, monospace; }
"""


def html_document(*, title: str, heading: str, setting: str, body: str, css: str = "") -> str:
    """Return a page.

    Args:
        title: of the window.
        heading: of the page.
        setting: a line below the heading: what this is about.
        body: HTML of all that follows; everything before is escaped here.
        css: rules besides those that all pages have.
    """
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<title>{escape(title)}</title>
<style>{CSS}{css}</style>
</head>
<body>
<main>
<h1>{escape(heading)}</h1>
<p class="setting">{escape(setting)}</p>
{body}
</main>
</body>
</html>
"""


def verdict_html(good: bool, word: str, content: str) -> str:
    """Return the box of a verdict: a word, and the HTML of what follows it."""
    return f'<div class="{"verdict" if good else "verdict failed"}"><strong>{escape(word)}</strong>{content}</div>'
