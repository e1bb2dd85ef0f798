//! The words of a SPIR-V module. Enters: words. Leaves: its instructions one by one, and literal strings.

const HEADER_WORDS: usize = 5;

/// Opcode and words, the first one with them, of each instruction. Ends where a module is damaged.
pub(super) fn instructions(words: &[u32]) -> impl Iterator<Item = (u32, &[u32])> {
    let mut rest = words.get(HEADER_WORDS..).unwrap_or_default();
    std::iter::from_fn(move || {
        let first = *rest.first()?;
        let (instruction, after) = rest.split_at_checked((first >> 16) as usize)?;
        rest = after;
        (!instruction.is_empty()).then_some((first & 0xffff, instruction))
    })
}

/// A literal string: UTF-8, four bytes a word, ended by a zero.
pub(super) fn text_of(words: &[u32]) -> String {
    let bytes: Vec<u8> =
        words.iter().flat_map(|word| word.to_le_bytes()).take_while(|byte| *byte != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}
