//! Bytes compressed by meshoptimizer, as `EXT_meshopt_compression` and `KHR_meshopt_compression` describe them.
//! In: a stream with what the file says about it. Out: the elements, tightly packed. No byte of a stream is trusted:
//! one that ends early, goes on or says what no encoder writes is refused, and memory is bounded by the stream.
//! Format: appendices A and B of the extensions.

mod filter;
mod index;
mod vertex;

/// Bytes of a stream that are still to be read.
struct Bytes<'a>(&'a [u8]);

const CUT_OFF: &str = "the compressed stream is cut off";

impl<'a> Bytes<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or(CUT_OFF)?;
        self.0 = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, String> {
        let (&first, rest) = self.0.split_first().ok_or(CUT_OFF)?;
        self.0 = rest;
        Ok(first)
    }

    /// Splits off the last `count` bytes.
    fn tail(&mut self, count: usize) -> Result<&'a [u8], String> {
        let at = self.0.len().checked_sub(count).ok_or(CUT_OFF)?;
        let (rest, tail) = self.0.split_at(at);
        self.0 = rest;
        Ok(tail)
    }

    /// Which of the known first bytes the stream has.
    fn header(&mut self, known: &[u8]) -> Result<usize, String> {
        let header = self.byte()?;
        let version = known.iter().position(|&known| known == header);
        version.ok_or_else(|| format!("a compressed stream of this mode does not begin with {header:#04x}"))
    }

    fn finish(self) -> Result<(), String> {
        match self.0.len() {
            0 => Ok(()),
            more => Err(format!("the compressed stream goes on for {more} bytes after its last element")),
        }
    }
}

/// Decodes a stream of `count` elements of `stride` bytes. `mode` and `filter` are the texts of the file.
///
/// # Errors
/// In words, when the texts, the sizes or the stream are not what the extensions allow.
pub(super) fn decode(
    mode: &str,
    filter: &str,
    count: usize,
    stride: usize,
    stream: &[u8],
) -> Result<Vec<u8>, String> {
    let stream = Bytes(stream);
    if mode == "ATTRIBUTES" {
        let filter = filter::named(filter, stride)?;
        let mut elements = vertex::decode(count, stride, stream)?;
        filter(&mut elements);
        return Ok(elements);
    }
    let read = match mode {
        "TRIANGLES" => index::triangles,
        "INDICES" => index::sequence,
        other => return Err(format!("mode {other:?} does not exist")),
    };
    if filter != "NONE" {
        return Err(format!("mode {mode} has no filter {filter}"));
    }
    if !matches!(stride, 2 | 4) {
        return Err(format!("byteStride is {stride}, indices have 2 or 4 bytes"));
    }
    let indices = read(count, stream)?;
    if stride == 4 {
        return Ok(indices.into_iter().flat_map(u32::to_le_bytes).collect());
    }
    let narrow =
        |index: u32| u16::try_from(index).map_err(|_| format!("index {index} does not fit into 16 bits"));
    let indices: Vec<u16> = indices.into_iter().map(narrow).collect::<Result<_, _>>()?;
    Ok(indices.into_iter().flat_map(u16::to_le_bytes).collect())
}

#[cfg(test)]
mod tests;
