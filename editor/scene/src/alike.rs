//! Lists of what was found, in which thousands may differ in a number alone. In: a list. Out: the first few of each kind,
//! and one that counts the others.

use std::collections::HashMap;
use std::hash::Hash;

/// How many of one kind are listed.
const MOST_LISTED: usize = 10;

/// What a text has in common with others of its kind: all but its numbers, and names in quotation marks or brackets.
pub(crate) fn kind_of(text: &str) -> String {
    let mut kind = String::new();
    let mut close = None;
    for c in text.chars() {
        match (close, c) {
            (Some(end), c) if c == end => close = None,
            (Some(_), _) | (None, '0'..='9') => {}
            (None, '"') => close = Some('"'),
            (None, '(') => close = Some(')'),
            (None, c) => kind.push(c),
        }
    }
    kind
}

/// The first of each kind; after them `more` of the last that is listed, the last of all and the number that is left out.
pub(crate) fn summed<T, K: Hash + Eq>(
    list: Vec<T>,
    kind: impl Fn(&T) -> K,
    more: impl Fn(&T, &T, usize) -> T,
) -> Vec<T> {
    let mut places: HashMap<K, Vec<usize>> = HashMap::new();
    if list.len() <= MOST_LISTED + 1 {
        return list;
    }
    for (place, one) in list.iter().enumerate() {
        places.entry(kind(one)).or_default().push(place);
    }
    let mut sums = HashMap::new();
    let mut left_out = vec![false; list.len()];
    for places in places.into_values().filter(|places| places.len() > MOST_LISTED + 1) {
        let (listed, rest) = places.split_at(MOST_LISTED);
        for place in rest {
            left_out.get_mut(*place).into_iter().for_each(|left_out| *left_out = true);
        }
        let ends = listed.last().zip(rest.last());
        let ends = ends.and_then(|(&listed, last)| Some((listed, list.get(listed)?, list.get(*last)?)));
        sums.extend(ends.map(|(place, listed, last)| (place, more(listed, last, rest.len()))));
    }
    let mut out = Vec::new();
    for (place, (one, _)) in list.into_iter().zip(left_out).enumerate().filter(|(_, (_, left_out))| !left_out)
    {
        out.push(one);
        out.extend(sums.remove(&place));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_of_a_kind_are_listed_and_the_others_counted() {
        let mut list: Vec<String> = (0..50).map(|i| format!("/images/{i}: none \"{i} a\" (b {i})")).collect();
        list.push("/images/3: grey".to_owned());
        let more = |_: &String, last: &String, count: usize| format!("{count} more to {last}");
        let short = summed(list.clone(), |text| kind_of(text), more);
        assert_eq!(short.len(), MOST_LISTED + 2);
        assert_eq!(short[..MOST_LISTED], list[..MOST_LISTED]);
        assert_eq!(short[MOST_LISTED..], ["40 more to /images/49: none \"49 a\" (b 49)", "/images/3: grey"]);
        let few = list[..MOST_LISTED + 1].to_vec();
        assert_eq!(summed(few.clone(), |text| kind_of(text), more), few);
    }
}
