//! A table for a terminal that is Markdown too. Enters: cells. Leaves: lines on standard output.

/// A titled table.
pub(super) struct Table {
    title: String,
    /// The head first.
    rows: Vec<Vec<String>>,
    notes: Vec<String>,
}

impl Table {
    /// A table without rows.
    pub(super) fn new(title: impl Into<String>, head: &[&str]) -> Self {
        let rows = vec![head.iter().map(|cell| (*cell).to_owned()).collect()];
        Self { title: title.into(), rows, notes: Vec::new() }
    }

    /// Adds a row.
    pub(super) fn row(&mut self, cells: Vec<String>) {
        self.rows.push(cells);
    }

    /// Adds a sentence below the table.
    pub(super) fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    /// Prints it, its columns under one another.
    pub(super) fn print(&self) {
        say!("\n{}\n", self.title);
        self.lines().iter().for_each(|line| say!("{line}"));
        if !self.notes.is_empty() {
            say!("");
        }
        self.notes.iter().for_each(|note| say!("{note}"));
    }

    fn lines(&self) -> Vec<String> {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let cell = |row: &Vec<String>, column: usize| row.get(column).cloned().unwrap_or_default();
        let widths: Vec<usize> = (0..columns)
            .map(|column| self.rows.iter().map(|row| cell(row, column).chars().count()).max().unwrap_or(0))
            .collect();
        let line = |row: &Vec<String>| {
            let cells = widths.iter().enumerate().map(|(i, &width)| format!("{:width$}", cell(row, i)));
            format!("| {} |", cells.collect::<Vec<_>>().join(" | "))
        };
        let mut lines: Vec<String> = self.rows.iter().map(line).collect();
        let rule: Vec<String> = widths.iter().map(|&width| "-".repeat(width + 2)).collect();
        lines.insert(1.min(lines.len()), format!("|{}|", rule.join("|")));
        lines
    }
}

/// Three significant digits, and no more than three after the point.
pub(super) fn figure(value: f64) -> String {
    let digits = match value.abs() {
        x if x >= 100.0 => 0,
        x if x >= 10.0 => 1,
        x if x >= 1.0 => 2,
        _ => 3,
    };
    format!("{value:.digits$}")
}

/// A ratio in words.
pub(super) fn times(ratio: Option<f64>) -> String {
    ratio.map_or_else(String::new, |ratio| format!("x {ratio:.2}"))
}

/// A whole number with its thousands set apart.
pub(super) fn count(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_stand_under_one_another() {
        let mut table = Table::new("title", &["a", "long head"]);
        table.row(vec![String::from("wide cell"), String::from("1")]);
        table.row(vec![String::from("x")]);
        let expected =
            ["| a         | long head |", "|-----------|-----------|", "| wide cell | 1         |"];
        assert_eq!(table.lines()[..3], expected);
        assert!(table.lines().iter().all(|line| line.len() == expected[0].len()));
    }

    #[test]
    fn figures_are_short() {
        assert_eq!([0.0123, 4.567, 12.34, 1234.5].map(figure), ["0.012", "4.57", "12.3", "1234"]);
        assert_eq!([0, 12, 123, 1000, 1_234_567].map(count), ["0", "12", "123", "1,000", "1,234,567"]);
    }
}
