//! Spheres and boxes from a text file (`.xyz`, `.csv`, `.txt`). One shape a line, numbers parted by blanks, tabs, commas or
//! semicolons: `x y z r` is a sphere, `x y z hx hy hz` a box with half extents. `#` begins a remark; a first line without
//! any number is a head. Metres. Out: the shapes in the order of the file, or an error that names the line.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;

use super::ImportError;
use crate::assets::{MOST_SHAPES, Shape, ShapeFile};

/// Reads a file of spheres and boxes.
///
/// # Errors
/// With file, line and reason when it cannot be read, a line holds something else, or there are too many.
pub fn load_shapes(path: &Path) -> Result<ShapeFile, ImportError> {
    let bytes = super::read_model_file(path)?;
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
    for (index, line) in text.lines().enumerate() {
        let content = line.split('#').next().unwrap_or_default();
        let words: Vec<&str> = content
            .split(|c: char| c.is_whitespace() || c == ',' || c == ';')
            .filter(|word| !word.is_empty())
            .collect();
        if words.is_empty() {
            continue;
        }
        let is_head = !begun && words.iter().all(|word| word.parse::<f32>().is_err());
        begun = true;
        if !is_head {
            shapes.push(shape(&words).map_err(|reason| (index + 1, reason))?);
        }
        if shapes.len() > MOST_SHAPES as usize {
            return Err((index + 1, format!("there are more than {MOST_SHAPES} shapes")));
        }
    }
    Ok(shapes)
}

fn shape(words: &[&str]) -> Result<Shape, String> {
    let mut numbers = [0.0_f32; 6];
    if !matches!(words.len(), 4 | 6) {
        return Err(format!("expected 4 numbers (x y z r) or 6 (x y z hx hy hz), found {}", words.len()));
    }
    for (number, word) in numbers.iter_mut().zip(words) {
        *number = word.parse().map_err(|_| format!("\"{word}\" is not a number"))?;
        if !number.is_finite() {
            return Err(format!("\"{word}\" is no finite number"));
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
        let expected = [
            Shape::sphere(Vec3::new(1.0, 2.0, 3.0), 0.5),
            Shape::sphere(Vec3::new(-1.0, 2.0, 3.0), 4.0),
            Shape::cuboid(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0)),
        ];
        assert_eq!(parse(text).unwrap(), expected);
    }

    #[test]
    fn faults_name_their_line() {
        let fault = |text: &str| parse(text).unwrap_err();
        assert_eq!(fault("0 0 0 1\n0 0 0").0, 2);
        assert!(fault("0 0 0 1\n0 0 0").1.contains("found 3"));
        assert_eq!(fault("0 0 0 1\nx y z r").0, 2, "a head stands first");
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
