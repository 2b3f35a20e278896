//! The frame of the pages that commands write: HTML that needs no network and no script.

/// A whole page; `body` is HTML.
pub fn document(title: &str, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n{body}\
         <footer>octofold {}</footer>\n</main>\n</body>\n</html>\n",
        escape(title),
        env!("CARGO_PKG_VERSION")
    )
}

/// Text as HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

const STYLE: &str = "\
:root { color-scheme: light dark; --line: #8884; --soft: #8881; }
body { margin: 0; font: 16px/1.5 system-ui, sans-serif; }
main { max-width: 72rem; margin: 0 auto; padding: 2rem 1.25rem 4rem; }
h1 { font-size: 2.25rem; margin: 0 0 .5rem; }
h2 { font-size: 1.35rem; margin: 3rem 0 .25rem; }
h3 { font-size: 1.05rem; margin: 1.75rem 0 .5rem; }
p { max-width: 44rem; margin: .25rem 0 1rem; }
.panels { display: grid; grid-auto-flow: column; grid-auto-columns: 1fr; gap: 1rem; }
.grid { display: grid; grid-template-columns: repeat(auto-fit, minmax(18rem, 1fr)); gap: 1rem; }
figure { margin: 0; }
figure img { width: 100%; display: block; border: 1px solid var(--line); border-radius: 8px; }
figcaption { margin-top: .4rem; font-family: ui-monospace, monospace; font-size: .875rem; }
table { border-collapse: collapse; margin: 1rem 0; font-size: .875rem; width: 100%; }
th, td { text-align: left; padding: .25rem .75rem .25rem 0; border-bottom: 1px solid var(--line); }
td { font-variant-numeric: tabular-nums; }
th { font-weight: 500; }
.wide { overflow-x: auto; }
caption { text-align: left; font-weight: 600; padding: .5rem 0; }
.figures td, .figures th + th { text-align: right; white-space: nowrap; }
.figures tr > th:first-child { white-space: nowrap; }
pre { background: var(--soft); padding: .75rem 1rem; border-radius: 8px; overflow-x: auto; }
footer { margin-top: 4rem; opacity: .6; }
@media (max-width: 44rem) { .panels { grid-auto-flow: row; } }
";
