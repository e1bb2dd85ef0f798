//! What is wrong with a shader, with file, line, column and the line itself. Enters: the log of glslang. Leaves: faults.

use std::collections::{BTreeMap, HashSet};
use std::fmt;

use super::sources::Source;
use crate::error::RendererError;

/// So many faults are listed.
const MOST_LISTED: usize = 20;
/// So many characters of a line are shown.
const MOST_SHOWN: usize = 120;

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
    /// How many more there are that are not listed.
    pub more: usize,
}

impl ShaderFault {
    /// A fault of a whole file.
    pub fn whole(file: &str, message: impl Into<String>) -> Self {
        Self { file: file.to_owned(), message: message.into(), ..Self::default() }
    }

    /// A fault at the first line that holds all of these words outside of comments: where the first one stands alone if it does
    /// somewhere, and in the main file if it can be.
    pub(super) fn at(source: &Source, words: &[&str], message: impl Into<String>) -> Self {
        let place_in = |line: &str, only_alone: bool| {
            let code = line.split("//").next().unwrap_or_default();
            let first = words.first().filter(|word| !word.is_empty())?;
            let at = byte_of(code, first, None).filter(|at| !only_alone || is_alone(code, first, *at))?;
            words.iter().all(|word| code.contains(word)).then(|| line[..at].chars().count() + 1)
        };
        let main = source.texts.get_key_value(&source.file);
        let search = |only_alone: bool| {
            main.into_iter().chain(&source.texts).find_map(|(file, text)| {
                let found = |(index, line)| Some((file, index, line, place_in(line, only_alone)?));
                text.lines().enumerate().find_map(found)
            })
        };
        let Some((file, index, line, column)) = search(true).or_else(|| search(false)) else {
            return Self::whole(&source.file, message);
        };
        Self {
            file: file.clone(),
            line: u32::try_from(index + 1).ok(),
            column: u32::try_from(column).ok(),
            message: message.into(),
            source_line: Some(line.to_owned()),
            more: 0,
        }
    }

    /// An error about a stage's interface with its place in the texts, where it quotes what is there.
    pub(super) fn placed(source: &Source, error: RendererError) -> RendererError {
        let RendererError::Interface { file, reason } = error else { return error };
        let word = match reason.strip_prefix("struct ").and_then(|rest| rest.split([':', ' ']).next()) {
            Some(name) => format!("struct {name}"),
            None if reason.starts_with("push constants") => String::from("push_constant"),
            None => quoted(&reason).unwrap_or_default().to_owned(),
        };
        RendererError::Compile { file, faults: vec![Self::at(source, &[&word], reason)] }
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

    /// The faults in a log of glslang about a main file, which it calls `0`. `refused`: why an include is not there, by path.
    pub(super) fn of_log(log: &str, source: &Source, refused: &BTreeMap<String, String>) -> Vec<Self> {
        let mut faults: Vec<Self> = Vec::new();
        let (mut seen, mut more, mut is_listed) = (HashSet::new(), 0, true);
        for line in log.lines().filter(|line| !line.trim().is_empty() && !line.contains("compilation errors"))
        {
            let error = line.strip_prefix("ERROR: ");
            if error.is_some() {
                let is_new = seen.insert(line);
                is_listed = is_new && faults.len() < MOST_LISTED;
                more += usize::from(is_new && !is_listed);
            }
            if !is_listed {
                continue;
            }
            match error.and_then(|rest| Self::of_line(rest, source, refused)) {
                Some(fault) => faults.push(fault),
                None => match faults.last_mut() {
                    Some(fault) => fault.message = format!("{}\n{line}", fault.message),
                    None => faults.push(Self::whole(&source.file, line.trim_start_matches("ERROR: "))),
                },
            }
        }
        if faults.iter().any(Self::is_of_include) {
            // What else is wrong may only be so without it.
            faults.retain(Self::is_of_include);
        } else if let Some(last) = faults.last_mut() {
            last.more = more;
        }
        faults
    }

    /// Whether an included file is not there.
    fn is_of_include(&self) -> bool {
        self.message.starts_with("include \"")
    }

    /// `file:line:column: message`.
    fn of_line(text: &str, source: &Source, refused: &BTreeMap<String, String>) -> Option<Self> {
        let (file, rest) = text.split_once(':')?;
        let (number, message) = rest.split_once(':')?;
        let line: u32 = number.trim().parse().ok()?;
        let file = if file == "0" { &source.file } else { file };
        let source_line =
            source.texts.get(file).and_then(|text| text.lines().nth(line.saturating_sub(1) as usize));
        let said = message.split_once(':').and_then(|(column, rest)| Some((column.parse().ok()?, rest)));
        let (end, message) = said.map_or((None, message), |(column, rest): (u32, _)| (Some(column), rest));
        let message = message.trim();
        let column = source_line.and_then(|line| place_in(line, quoted(message), end));
        let include = message.split_once("for header name: ").map(|(_, path)| path.trim());
        let include = include.and_then(|path| Some(format!("include \"{path}\": {}", refused.get(path)?)));
        Some(Self {
            file: file.to_owned(),
            line: Some(line),
            column,
            message: include.unwrap_or_else(|| message.to_owned()),
            source_line: source_line.map(str::to_owned),
            more: 0,
        })
    }

    /// In order of their places, each once, a file that is not there too, and no more of them than are listed.
    pub(super) fn in_order(mut faults: Vec<Self>) -> Vec<Self> {
        faults.sort_by(|a, b| {
            (&a.file, a.line, a.column, &a.message).cmp(&(&b.file, b.line, b.column, &b.message))
        });
        faults.dedup();
        let mut includes = HashSet::new();
        faults.retain(|fault| !fault.is_of_include() || includes.insert(fault.message.clone()));
        let beyond = faults.split_off(MOST_LISTED.min(faults.len()));
        if let Some(last) = faults.last_mut() {
            last.more += beyond.iter().map(|fault| 1 + fault.more).sum::<usize>();
        }
        faults
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
    let places = line.match_indices(word).map(|(at, _)| at);
    places.min_by_key(|at| (!is_alone(line, word, *at), end.map(|end| (at + 1).abs_diff(end as usize))))
}

/// Whether the word there is no part of a longer name.
fn is_alone(line: &str, word: &str, at: usize) -> bool {
    let before = line.get(..at).and_then(|text| text.chars().next_back());
    let after = line.get(at + word.len()..).and_then(|text| text.chars().next());
    !before.is_some_and(of_name) && !after.is_some_and(of_name)
}

impl fmt::Display for ShaderFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        for number in self.line.iter().chain(&self.column) {
            write!(f, ":{number}")?;
        }
        write!(f, ": {}", self.message)?;
        if let Some(line) = &self.source_line {
            write_line(f, line, self.column)?;
        }
        match self.more {
            0 => Ok(()),
            1 => write!(f, "\nand one more error"),
            more => write!(f, "\nand {more} more errors"),
        }
    }
}

/// A line, of a long one what is around the column, and below it a mark at the column.
fn write_line(f: &mut fmt::Formatter<'_>, line: &str, column: Option<u32>) -> fmt::Result {
    let at = column.unwrap_or(1).saturating_sub(1) as usize;
    let count = line.chars().count();
    let first = at.saturating_sub(MOST_SHOWN / 2).min(count.saturating_sub(MOST_SHOWN));
    let shown: String = line.chars().skip(first).take(MOST_SHOWN).collect();
    let [before, after] =
        [first > 0, first + MOST_SHOWN < count].map(|cut| if cut { "\u{2026}" } else { "" });
    write!(f, "\n    {before}{shown}{after}")?;
    if column.is_none() {
        return Ok(());
    }
    // Tabs stay tabs, so that the mark stands below its column.
    let blank = |c: char| if c == '\t' { c } else { ' ' };
    let indent: String = before.chars().chain(shown.chars().take(at - first)).map(blank).collect();
    write!(f, "\n    {indent}^")
}

/// The faults one below the other.
pub(crate) fn listed(faults: &[ShaderFault]) -> String {
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(texts: &[(&str, &str)]) -> Source {
        let texts = texts.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect();
        Source { file: "a.comp".to_owned(), texts, ..Source::default() }
    }

    #[test]
    fn of_many_faults_the_first_are_listed_and_of_long_lines_what_is_around_the_column() {
        let long = format!("{}oops{}", "a ".repeat(300), " b".repeat(300));
        let source = source(&[("a.comp", &long)]);
        let line = |n: usize| format!("ERROR: 0:1:602: 'oops' : {n}\nof it\n");
        let log: String = (0..20_000).chain(0..5).map(line).collect();
        let faults = ShaderFault::of_log(&log, &source, &BTreeMap::new());
        assert_eq!((faults.len(), faults[19].more), (20, 19_980));
        assert_eq!(faults[19].message, "'oops' : 19\nof it");
        let (around, after) = ("a ".repeat(30), " b".repeat(28));
        let shown = format!(
            "a.comp:1:601: 'oops' : 19\nof it\n    \u{2026}{around}oops{after}\u{2026}\n    {}^\nand 19980 more errors",
            " ".repeat(61)
        );
        assert_eq!(faults[19].to_string(), shown);
        let includes = |file: &&str| ShaderFault::whole(file, "include \"c\": there is no such file");
        let included: Vec<_> = ["b.comp", "c.comp"].iter().map(includes).collect();
        let two = [faults, included].concat();
        let listed = ShaderFault::in_order(two);
        assert_eq!((listed.len(), listed.iter().map(|fault| fault.more).sum::<usize>()), (20, 19_981));
    }

    #[test]
    fn a_fault_names_the_place_and_shows_the_line() {
        let source =
            source(&[("a.comp", "void main() {\n\tint x = xy + y;\n}\n"), ("lib/b.glsl", "oops;\n")]);
        let log = "ERROR: 0:2:15: 'y' : undeclared identifier\nERROR: 0:2:15: 'y' : undeclared identifier\n\
                   ERROR: lib/b.glsl:1:4: '' : syntax error\nERROR: lib/b.glsl:1: 'x' : of a line\nERROR: 2 compilation errors.  No code generated.\n\n";
        let faults = ShaderFault::of_log(log, &source, &BTreeMap::new());
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
            ShaderFault::of_log("no place", &source, &BTreeMap::new()),
            [ShaderFault::whole("a.comp", "no place")]
        );
    }
}
