//! What is wrong with a shader, with file, line, column and the line itself. Enters: the log of glslang. Leaves: faults.

use std::collections::BTreeMap;
use std::fmt;

use crate::error::RendererError;

/// One thing that is wrong with a shader.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ShaderFault {
    /// File, relative to the shader folder; an include where the fault is there.
    pub file: String,
    /// Line, from 1; `None`: the file as a whole.
    pub line: Option<u32>,
    /// Column in characters, from 1, where the compiler names what it stumbled over.
    pub column: Option<u32>,
    /// What is wrong.
    pub message: String,
    /// The text of the line.
    pub source_line: Option<String>,
}

impl ShaderFault {
    /// A fault of a whole file.
    pub fn whole(file: &str, message: impl Into<String>) -> Self {
        Self { file: file.to_owned(), message: message.into(), ..Self::default() }
    }

    /// The faults that an error stands for.
    pub fn of_error(error: RendererError) -> Vec<Self> {
        match error {
            RendererError::Compile { faults, .. } => faults,
            RendererError::Interface { file, reason } | RendererError::Source { file, reason } => {
                vec![Self::whole(&file, reason)]
            }
            other => vec![Self::whole("pipeline", other.to_string())],
        }
    }

    /// The faults in a log of glslang, which calls the main file `0`. `texts`: every file involved.
    pub(super) fn of_log(log: &str, main: &str, texts: &BTreeMap<String, String>) -> Vec<Self> {
        let mut faults: Vec<Self> = Vec::new();
        for line in log.lines().filter(|line| !line.trim().is_empty() && !line.contains("compilation errors"))
        {
            match line.strip_prefix("ERROR: ").and_then(|rest| Self::of_line(rest, main, texts)) {
                Some(fault) if faults.contains(&fault) => {}
                Some(fault) => faults.push(fault),
                None => match faults.last_mut() {
                    Some(fault) => fault.message = format!("{}\n{line}", fault.message),
                    None => faults.push(Self::whole(main, line.trim_start_matches("ERROR: "))),
                },
            }
        }
        faults
    }

    /// `file:line:column: message`.
    fn of_line(text: &str, main: &str, texts: &BTreeMap<String, String>) -> Option<Self> {
        let (file, rest) = text.split_once(':')?;
        let (number, message) = rest.split_once(':')?;
        let line: u32 = number.trim().parse().ok()?;
        let file = if file == "0" { main } else { file };
        let source_line = texts.get(file).and_then(|text| text.lines().nth(line.saturating_sub(1) as usize));
        let said = message.split_once(':').and_then(|(column, rest)| Some((column.parse().ok()?, rest)));
        let (end, message) = said.map_or((None, message), |(column, rest): (u32, _)| (Some(column), rest));
        let message = message.trim();
        let column = source_line.and_then(|line| place_in(line, quoted(message), end));
        Some(Self {
            file: file.to_owned(),
            line: Some(line),
            column,
            message: message.to_owned(),
            source_line: source_line.map(str::to_owned),
        })
    }
}

/// What a message begins with in quotes: the word that the compiler stumbled over.
fn quoted(message: &str) -> Option<&str> {
    message.strip_prefix('\'')?.split_once('\'').map(|(word, _)| word).filter(|word| !word.is_empty())
}

fn of_name(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// The column of a fault: where the word stands, of several places the one nearest to where the compiler had read to; without
/// a word the place that it had read to. `end`: in bytes, from 1.
fn place_in(line: &str, word: Option<&str>, end: Option<u32>) -> Option<u32> {
    let of_word = word.and_then(|word| byte_of(line, word, end));
    let of_end = || {
        let last = (end?.checked_sub(1)? as usize).min(line.len());
        // A word that was read to its last letter begins before it.
        let word = line.get(..=last).map_or(0, |text| text.chars().rev().take_while(|c| of_name(*c)).count());
        Some(last - word.saturating_sub(1))
    };
    let before = line.get(..of_word.or_else(of_end)?)?;
    u32::try_from(before.chars().count() + 1).ok()
}

/// Where a word stands alone in a line, else where it stands at all.
fn byte_of(line: &str, word: &str, end: Option<u32>) -> Option<usize> {
    let alone = |at: &usize| {
        let before = line.get(..*at).and_then(|text| text.chars().next_back());
        let after = line.get(at + word.len()..).and_then(|text| text.chars().next());
        !before.is_some_and(of_name) && !after.is_some_and(of_name)
    };
    let places = line.match_indices(word).map(|(at, _)| at);
    places.min_by_key(|at| (!alone(at), end.map(|end| (at + 1).abs_diff(end as usize))))
}

impl fmt::Display for ShaderFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        for number in self.line.iter().chain(&self.column) {
            write!(f, ":{number}")?;
        }
        write!(f, ": {}", self.message)?;
        let Some(line) = &self.source_line else { return Ok(()) };
        // Tabs stay tabs, so that the mark stands below its column.
        let blank = |c: char| if c == '\t' { c } else { ' ' };
        write!(f, "\n    {line}")?;
        let Some(column) = self.column else { return Ok(()) };
        let indent: String = line.chars().take(column.saturating_sub(1) as usize).map(blank).collect();
        write!(f, "\n    {indent}^")
    }
}

/// The faults one below the other.
pub(crate) fn listed(faults: &[ShaderFault]) -> String {
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_names_the_place_and_shows_the_line() {
        let texts = [("a.comp", "void main() {\n\tint x = xy + y;\n}\n"), ("lib/b.glsl", "oops;\n")];
        let texts = texts.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect();
        let log = "ERROR: 0:2:15: 'y' : undeclared identifier\nERROR: 0:2:15: 'y' : undeclared identifier\n\
                   ERROR: lib/b.glsl:1:4: '' : syntax error\nERROR: lib/b.glsl:1: 'x' : of a line\nERROR: 2 compilation errors.  No code generated.\n\n";
        let faults = ShaderFault::of_log(log, "a.comp", &texts);
        assert_eq!(faults.len(), 3, "{faults:?}");
        let shown = listed(&faults);
        assert_eq!(
            shown,
            "a.comp:2:15: 'y' : undeclared identifier\n    \tint x = xy + y;\n    \t             ^\n\
             lib/b.glsl:1:1: '' : syntax error\n    oops;\n    ^\nlib/b.glsl:1: 'x' : of a line\n    oops;"
        );
        // Of two places the one that the compiler had read; bytes are no columns.
        assert_eq!(place_in("a = a + 1;", Some("a"), Some(5)), Some(5));
        assert_eq!(place_in("a = a + 1;", Some("a"), None), Some(1));
        assert_eq!(place_in("/* \u{e4} */ x == y;", None, Some(13)), Some(12));
        assert_eq!(place_in("", None, Some(1)), Some(1));
        assert_eq!(place_in("x", None, Some(0)), None);
        assert_eq!(
            ShaderFault::of_log("no place", "a.comp", &texts),
            [ShaderFault::whole("a.comp", "no place")]
        );
    }
}
