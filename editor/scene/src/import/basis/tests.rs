use super::{Canvas, uastc};

/// Blocks of any kind that exist, each decoded by Basis Universal 1.16 too (`unpack_uastc` without sRGB): the hash is that
/// of its texels, block by block.
#[test]
fn uastc_gives_the_texels_of_basis_universal() {
    let mut state = 12_345_u32;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        (state >> 9) as u8
    };
    let (mut found, mut refused, mut hash) = (0, 0, 0xcbf2_9ce4_8422_2325_u64);
    while found < 20_000 {
        let block: [u8; 16] = std::array::from_fn(|_| next());
        let Ok(texels) = uastc::decode(&block, Canvas::new(4, 4)) else {
            refused += 1;
            continue;
        };
        found += 1;
        hash = texels.iter().fold(hash, |hash, &v| (hash ^ u64::from(v)).wrapping_mul(0x0100_0000_01b3));
    }
    assert_eq!(hash, 0x66d7_c64e_c587_c9dd);
    // The rest has a mode or partition that does not exist.
    assert!((100..4000).contains(&refused), "{refused}");
}
