//! A table, as Markdown and as HTML.

use crate::page::escape;

/// What stands where there is nothing to tell.
const NONE: &str = "–";

/// Cells of text under headings; the first column names the row.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Headings.
    pub head: Vec<String>,
    /// Rows, as long as the head.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// The table without the columns in which no row has anything to tell.
    #[must_use]
    pub fn without_blanks(mut self) -> Self {
        let told = |column: usize| self.rows.iter().any(|row| row[column] != NONE);
        let told: Vec<bool> = (0..self.head.len()).map(told).collect();
        let thin = |row: &mut Vec<String>| {
            let mut column = told.iter();
            row.retain(|_| column.next().is_some_and(|&t| t));
        };
        self.rows.iter_mut().chain([&mut self.head]).for_each(thin);
        self
    }

    /// The table with a heading, as Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let rule: Vec<String> =
            (0..self.head.len()).map(|i| if i == 0 { "---" } else { "---:" }.into()).collect();
        let rows: String = self.rows.iter().map(|row| line(row)).collect();
        format!("## {}\n\n{}{}{rows}\n", self.caption, line(&self.head), line(&rule))
    }

    /// The table as HTML.
    pub fn html(&self) -> String {
        let cells = |tag: &str, row: &[String]| -> String {
            let cell = |(i, text): (usize, &String)| {
                let tag = if i == 0 { "th" } else { tag };
                format!("<{tag}>{}</{tag}>", escape(text))
            };
            row.iter().enumerate().map(cell).collect()
        };
        let rows: String =
            self.rows.iter().map(|row| format!("<tr>{}</tr>\n", cells("td", row))).collect();
        format!(
            "<div class=\"wide\"><table class=\"figures\">\n<caption>{}</caption>\n\
             <tr>{}</tr>\n{rows}</table></div>\n",
            escape(&self.caption),
            cells("th", &self.head)
        )
    }
}

/// A number with a fitting count of digits: three that matter, all of a whole part.
pub fn digits(value: f64) -> String {
    let places = match value.abs() {
        v if v >= 100.0 || v == 0.0 => 0,
        v if v >= 10.0 => 1,
        v if v >= 1.0 => 2,
        v if v >= 0.1 => 3,
        v if v >= 0.01 => 4,
        _ => 5,
    };
    format!("{value:.places$}")
}

/// A count, or a dash where there is none.
pub fn count<T: ToString>(value: Option<T>) -> String {
    value.map_or_else(|| NONE.into(), |v| v.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_forms_hold_every_cell() {
        let table = Table {
            caption: "a < b".into(),
            head: vec!["x".into(), "y".into()],
            rows: vec![vec!["one".into(), "1".into()]],
        };
        assert_eq!(table.markdown(), "## a < b\n\n| x | y |\n| --- | ---: |\n| one | 1 |\n\n");
        let html = table.html();
        assert!(html.contains("<caption>a &lt; b</caption>"));
        assert!(html.contains("<tr><th>one</th><td>1</td></tr>"));
    }

    #[test]
    fn blank_columns_are_left_out() {
        let row = |cells: [&str; 3]| cells.map(String::from).to_vec();
        let table = Table {
            caption: String::new(),
            head: row(["a", "b", "c"]),
            rows: vec![row(["1", NONE, NONE]), row(["2", NONE, "3"])],
        };
        let thin = table.without_blanks();
        assert_eq!((thin.head[1].as_str(), thin.rows[0][1].as_str()), ("c", NONE));
        assert!(thin.rows.iter().all(|row| row.len() == 2));
    }

    #[test]
    fn small_numbers_keep_their_digits() {
        let text = [0.0, 0.00312, 0.0307, 0.5174, 1.17, 11.13, 153.7].map(digits);
        assert_eq!(text, ["0", "0.00312", "0.0307", "0.517", "1.17", "11.1", "154"]);
        assert_eq!((count(Some(3)), count(None::<u8>)), ("3".into(), "–".into()));
    }
}
