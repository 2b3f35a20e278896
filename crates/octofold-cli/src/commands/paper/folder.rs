//! The folder of an experiment: tables, all figures as JSON and CSV, and a page to look at.

use super::table::Table;
use crate::job::{Account, Job, Outcome};
use crate::{files, page};
use anyhow::{Context, Result};
use serde::Serialize;
use std::path::PathBuf;

/// A folder that is there.
pub struct Folder(PathBuf);

impl Folder {
    /// Makes the folder where it is missing.
    pub fn create(path: PathBuf) -> Result<Self> {
        std::fs::create_dir_all(&path).with_context(|| path.display().to_string())?;
        Ok(Self(path))
    }

    /// The path of a file in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Writes a file.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        files::write(&self.path(name), bytes)
    }

    /// Writes what was found, with a page of the given body, and says where that is.
    pub fn finish(
        &self,
        job: &Job,
        title: &str,
        tables: &[Table],
        results: &impl Serialize,
        csv: &str,
        body: &str,
    ) -> Result<Outcome> {
        let text: String = tables.iter().map(Table::markdown).collect();
        self.write("tables.md", format!("# {title}\n\n{text}").as_bytes())?;
        self.write("results.json", &serde_json::to_vec_pretty(results)?)?;
        self.write("results.csv", csv.as_bytes())?;
        self.write("index.html", page::document(title, body).as_bytes())?;
        job.finish(Account::default())?;
        let (index, seconds) = (self.path("index.html"), job.terminal.seconds());
        job.terminal.say(&format!("{}: open it in a browser, {seconds:.1} s", index.display()));
        Ok(Outcome::Holds)
    }
}

/// A paragraph of a page.
pub fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", page::escape(text))
}

/// A picture on a page, with a caption where that is not empty.
pub fn figure(name: &str, caption: &str) -> String {
    let caption = match caption {
        "" => String::new(),
        text => format!("<figcaption>{}</figcaption>", page::escape(text)),
    };
    format!("<figure><img src=\"{name}\" alt=\"{name}\">{caption}</figure>\n")
}

/// Pictures side by side.
pub fn gallery(figures: &str) -> String {
    format!("<div class=\"grid\">\n{figures}</div>\n")
}

/// All tables on a page, and where they are beside it.
pub fn tables(tables: &[Table]) -> String {
    let tables: String = tables.iter().map(Table::html).collect();
    format!(
        "<h2>Tables</h2>\n{tables}<p><a href=\"tables.md\">tables.md</a>, \
         <a href=\"results.csv\">results.csv</a>, <a href=\"results.json\">results.json</a></p>\n"
    )
}
