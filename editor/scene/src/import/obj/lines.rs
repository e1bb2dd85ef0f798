//! A look at the lines of an OBJ file before tobj reads it, because tobj's errors name no line.
//! In: the text. Out: whether it wants smooth normals, or the first bad line and what is wrong with it.

/// What the lines tell besides vertices and faces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Facts {
    /// A smoothing group is switched on somewhere.
    pub smooth: bool,
}

/// How many positions, texture coordinates and normals came so far.
#[derive(Default)]
struct Seen {
    positions: usize,
    tex_coords: usize,
    normals: usize,
}

/// Checks numbers of vertices and indices of faces; the error is a line number, from 1, and a reason.
pub(super) fn check(text: &str) -> Result<Facts, (usize, String)> {
    let mut facts = Facts::default();
    let mut seen = Seen::default();
    for (number, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        let checked = match words.next() {
            Some("v") => {
                seen.positions += 1;
                numbers(words, 3)
            }
            Some("vt") => {
                seen.tex_coords += 1;
                numbers(words, 1)
            }
            Some("vn") => {
                seen.normals += 1;
                numbers(words, 3)
            }
            Some("f") => words.try_for_each(|corner| face_corner(corner, &seen)),
            Some("s") => {
                facts.smooth |= !matches!(words.next(), None | Some("off" | "0"));
                Ok(())
            }
            _ => Ok(()),
        };
        checked.map_err(|reason| (number + 1, reason))?;
    }
    Ok(facts)
}

fn numbers<'a>(words: impl Iterator<Item = &'a str>, least: usize) -> Result<(), String> {
    let mut count = 0;
    for word in words.take_while(|word| !word.starts_with('#')) {
        word.parse::<f32>().map_err(|_| format!("\"{word}\" is not a number"))?;
        count += 1;
    }
    match count < least {
        true => Err(format!("expected {least} numbers, found {count}")),
        false => Ok(()),
    }
}

fn face_corner(corner: &str, seen: &Seen) -> Result<(), String> {
    if corner.starts_with('#') {
        return Ok(());
    }
    let lists =
        [(seen.positions, "vertices"), (seen.tex_coords, "texture coordinates"), (seen.normals, "normals")];
    for (place, (index, (count, what))) in corner.split('/').zip(lists).enumerate() {
        if index.is_empty() && place > 0 {
            continue;
        }
        let number: i64 = index.parse().map_err(|_| format!("\"{corner}\" is no corner of a face"))?;
        let from_start = if number < 0 { count as i64 + number } else { number - 1 };
        if !(0..count as i64).contains(&from_start) {
            return Err(format!("index {number} is out of range, there are {count} {what} so far"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_the_line() {
        let good = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf -3//  -2 -1\n";
        assert_eq!(check(good), Ok(Facts { smooth: false }));
        assert_eq!(check("s 1\n"), Ok(Facts { smooth: true }));
        let line = |text| check(text).err().map(|(line, _)| line);
        assert_eq!(line("v 0 0 0\nf 1 2 3"), Some(2));
        assert_eq!(line("v 0 0 x"), Some(1));
        assert_eq!(line("\nv 0 0"), Some(2));
        assert_eq!(line("v 0 0 0\nf 1 0 1"), Some(2));
    }
}
