//! Spheres and boxes from a text file (`.xyz`, `.csv`, `.txt`). One shape a line, numbers parted by blanks, tabs, commas or
//! semicolons: `x y z r` is a sphere, `x y z hx hy hz` a box with half extents. `#` begins a remark; a first line without
//! any number is a head that names the columns. Metres. Out: the shapes in the order of the file, or an error that names the line.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;

use super::{ImportError, UTF16, is_utf16, short};
use crate::assets::{MOST_SHAPES, Shape, ShapeFile};

/// Reads a file of spheres and boxes.
///
/// # Errors
/// With file, line and reason when it cannot be read, a line holds something else, or there are too many.
pub fn load_shapes(path: &Path) -> Result<ShapeFile, ImportError> {
    let bytes = super::read_model_file(path)?;
    if is_utf16(&bytes) {
        return Err(ImportError::new(path, UTF16));
    }
    let text = std::str::from_utf8(&bytes).map_err(|error| {
        let line = bytes.iter().take(error.valid_up_to()).filter(|byte| **byte == b'\n').count() + 1;
        ImportError::new(path, "is no text in UTF-8").at(format!("line {line}"))
    })?;
    let shapes =
        parse(text).map_err(|(line, reason)| ImportError::new(path, reason).at(format!("line {line}")))?;
    if shapes.is_empty() {
        return Err(ImportError::new(path, "there are no spheres and no boxes in it"));
    }
    Ok(ShapeFile { path: path.to_owned(), shapes: Some(Arc::from(shapes)) })
}

fn parse(text: &str) -> Result<Vec<Shape>, (usize, String)> {
    let mut shapes = Vec::new();
    let mut begun = false;
    let mut head: Option<Head> = None;
    // Tables of some programs begin with a byte order mark, or end their lines as old Macs did.
    let text = text.trim_start_matches('\u{feff}');
    let end = if text.contains('\n') { '\n' } else { '\r' };
    for (index, line) in text.split(end).enumerate() {
        let content = line.split('#').next().unwrap_or_default();
        // Where semicolons part the numbers, commas are what others write as points.
        let content = content.replace(',', if content.contains(';') { "." } else { " " });
        let words: Vec<&str> = content
            .split(|c: char| c.is_whitespace() || c == ';')
            .map(|word| word.trim_matches(['"', '\'']))
            .filter(|word| !word.is_empty())
            .collect();
        if words.is_empty() {
            continue;
        }
        let is_head = !begun && words.iter().all(|word| word.parse::<f32>().is_err());
        begun = true;
        let fault = |reason| (index + 1, reason);
        if is_head {
            head = Some(Head::read(&words).map_err(fault)?);
            continue;
        }
        let in_order = match &head {
            Some(head) => head.in_order(words),
            None => Ok(words),
        };
        shapes.push(in_order.and_then(|words| shape(&words)).map_err(fault)?);
        if shapes.len() > MOST_SHAPES as usize {
            return Err((index + 1, format!("there are more than {MOST_SHAPES} shapes")));
        }
    }
    Ok(shapes)
}

/// What the columns of a table are called, in the order in which shapes have them.
const COLUMNS: [&[&str]; 2] = [&["x", "y", "z", "r"], &["x", "y", "z", "hx", "hy", "hz"]];

/// A first line that names columns: for each number of a shape, its place in a line.
struct Head {
    places: Vec<usize>,
}

impl Head {
    fn read(words: &[&str]) -> Result<Self, String> {
        let names: Vec<String> = words.iter().map(|word| word.to_ascii_lowercase()).collect();
        let names: Vec<&str> =
            names.iter().map(|name| if name == "radius" { "r" } else { name.as_str() }).collect();
        let expected = "columns are x, y, z and r (or radius) of spheres, x, y, z, hx, hy and hz of boxes";
        if let Some(unknown) = names.iter().find(|name| COLUMNS.iter().all(|known| !known.contains(name))) {
            return Err(format!(
                "there is no column \"{}\"; {expected}, and # begins a remark",
                short(unknown)
            ));
        }
        let place = |column: &&str| names.iter().position(|name| name == column);
        let places = |columns: &&[&str]| columns.iter().map(place).collect::<Option<Vec<usize>>>();
        let all = COLUMNS.iter().filter(|columns| columns.len() == names.len()).find_map(places);
        let missing =
            || format!("the columns {} are not those of a shape; {expected}", short(&names.join(", ")));
        all.map(|places| Self { places }).ok_or_else(missing)
    }

    /// The words of a line as shapes have them. Where the head has their order anyway, a line may be another shape.
    fn in_order<'a>(&self, words: Vec<&'a str>) -> Result<Vec<&'a str>, String> {
        let count = self.places.len();
        if words.len() != count && self.places.is_sorted() {
            return Ok(words);
        }
        if words.len() != count {
            return Err(format!("expected {count} numbers, as the head names, found {}", words.len()));
        }
        Ok(self.places.iter().filter_map(|&place| words.get(place).copied()).collect())
    }
}

fn shape(words: &[&str]) -> Result<Shape, String> {
    let mut numbers = [0.0_f32; 6];
    if !matches!(words.len(), 4 | 6) {
        return Err(format!("expected 4 numbers (x y z r) or 6 (x y z hx hy hz), found {}", words.len()));
    }
    for (number, word) in numbers.iter_mut().zip(words) {
        *number = word.parse().map_err(|_| format!("\"{}\" is not a number", short(word)))?;
        if !number.is_finite() {
            return Err(format!("\"{}\" is no finite number", short(word)));
        }
    }
    let [x, y, z, a, b, c] = numbers;
    if a < 0.0 || b < 0.0 || c < 0.0 {
        return Err(String::from("a size is negative"));
    }
    let centre = Vec3::new(x, y, z);
    Ok(if words.len() == 4 { Shape::sphere(centre, a) } else { Shape::cuboid(centre, Vec3::new(a, b, c)) })
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    #[test]
    fn spheres_and_boxes_in_every_notation() {
        let text = "# made by hand\nx;y;z;r\n1 2 3 0.5\n\n-1,2e0,\t3, 4 # a large one\n0;0;0;1;2;3\r\n";
        let of_comma_countries = "1;2,0;3;0,5\n-1,0;2;3;4\n0;0;0;1;2,0;3\n";
        let of_old_macs = "x,y,z,r\r\"1\",\"2\",'3',\".5\"\r";
        let expected = [
            Shape::sphere(Vec3::new(1.0, 2.0, 3.0), 0.5),
            Shape::sphere(Vec3::new(-1.0, 2.0, 3.0), 4.0),
            Shape::cuboid(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0)),
        ];
        assert_eq!(parse(text).unwrap(), expected);
        assert_eq!(parse(of_comma_countries).unwrap(), expected);
        assert_eq!(parse(of_old_macs).unwrap(), expected[..1]);
    }

    #[test]
    fn a_head_names_the_columns() {
        for text in
            ["x,y,z,r\n1,2,3,.5\n", "r,x,y,z\n.5,1,2,3\n", "\u{feff}\"Z\";\"Y\";\"X\";\"Radius\"\n3;2;1;.5\n"]
        {
            assert_eq!(parse(text).unwrap(), [Shape::sphere(Vec3::new(1.0, 2.0, 3.0), 0.5)], "{text}");
        }
        let boxes = parse("hx hy hz x y z\n4 5 6 1 2 3\n").unwrap();
        assert_eq!(boxes, [Shape::cuboid(Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0))]);
    }

    #[test]
    fn faults_name_their_line() {
        let fault = |text: &str| parse(text).unwrap_err();
        assert_eq!(fault("0 0 0 1\n0 0 0").0, 2);
        assert!(fault("0 0 0 1\n0 0 0").1.contains("found 3"));
        assert_eq!(fault("0 0 0 1\nx y z r").0, 2, "a head stands first");
        for (head, words) in [
            ("x,y,z,diameter", "no column \"diameter\""),
            ("x,y,z", "columns x, y, z are not"),
            ("x,y,z,r,r", "are not those of a shape"),
            ("x,y,z,z", "are not those of a shape"),
            ("x,y,z,hx,hy,r", "are not those of a shape"),
            ("my spheres", "no column \"my\""),
        ] {
            let (line, reason) = fault(&format!("# remark\n{head}\n1,2,3,.5\n"));
            assert!(line == 2 && reason.contains(words), "{head}: {reason}");
        }
        assert!(fault("r,x,y,z\n0,0,0,1,1,1").1.contains("expected 4 numbers, as the head names, found 6"));
        assert!(fault("0 0 0 1x").1.contains("\"1x\""));
        assert!(fault("0 0 nan 1").1.contains("finite"));
        assert!(fault("0 0 0 -1").1.contains("negative"));
    }

    #[test]
    fn files_that_are_none_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.xyz");
        assert!(load_shapes(&path).unwrap_err().reason.contains("cannot be opened"));
        std::fs::write(&path, b"0 0 0 1\n\xff").unwrap();
        assert_eq!(load_shapes(&path).unwrap_err().place, "line 2");
        std::fs::write(&path, "# nothing\n").unwrap();
        assert!(load_shapes(&path).unwrap_err().reason.contains("no spheres"));
        std::fs::write(&path, "0 0 0 1\n").unwrap();
        assert_eq!(load_shapes(&path).unwrap().shapes.unwrap().len(), 1);
    }
}
