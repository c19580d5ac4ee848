//! Seals: a file that carries a hash of itself.
//!
//! Formats check some of their bytes (PNG its chunks, OpenEXR the blocks that it could compress) and leave
//! others to chance. A sealed file has a JSON text somewhere that says `"seal":"..."` with 64 digits: BLAKE3
//! of the file's bytes with zeros in the place of those digits. Rot anywhere in the file, its header
//! included, breaks the seal.

/// What stands before the digits.
const KEY: &[u8] = br#""seal":""#;
/// Digits of a seal.
const DIGITS: usize = 2 * blake3::OUT_LEN;

/// A seal not yet set; part of the text that a file is written with. [`set_seal`] puts its digits in place.
pub const BLANK: &str = "0000000000000000000000000000000000000000000000000000000000000000";

/// Seals the bytes of a file that holds a [`BLANK`] seal; without one they are left as they are.
pub fn set_seal(bytes: &mut [u8]) {
    let Some(at) = find(bytes) else { return };
    let hash = hash(bytes);
    bytes[at..at + DIGITS].copy_from_slice(hash.to_hex().as_bytes());
}

/// Whether the bytes of a file are those that were sealed. Not so if there is no seal.
pub fn is_sealed(mut bytes: Vec<u8>) -> bool {
    let Some(at) = find(&bytes) else { return false };
    let seal = bytes[at..at + DIGITS].to_vec();
    bytes[at..at + DIGITS].fill(b'0');
    hash(&bytes).to_hex().as_bytes() == seal
}

/// Where the digits of the first seal begin.
fn find(bytes: &[u8]) -> Option<usize> {
    let mut from = 0;
    // Quotes are rare enough in binary data for a search without tables.
    while let Some(quote) = bytes[from..].iter().position(|&byte| byte == KEY[0]) {
        let at = from + quote;
        if bytes[at..].starts_with(KEY) {
            let digits = at + KEY.len();
            return (digits + DIGITS <= bytes.len()).then_some(digits);
        }
        from = at + 1;
    }
    None
}

fn hash(bytes: &[u8]) -> blake3::Hash {
    blake3::Hasher::new().update_rayon(bytes).finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_changed_byte_breaks_a_seal() {
        let text = format!(r#"x"y{{"a":1,"seal":"{BLANK}"}} and pixels "seal": end"#);
        let mut sealed = text.into_bytes();
        set_seal(&mut sealed);
        assert!(is_sealed(sealed.clone()));
        for at in 0..sealed.len() {
            let mut rotten = sealed.clone();
            rotten[at] ^= 1;
            assert!(!is_sealed(rotten), "byte {at}");
            assert!(!is_sealed(sealed[..at].to_vec()), "{at} bytes");
        }
        sealed.push(0);
        assert!(!is_sealed(sealed));
    }

    #[test]
    fn what_has_no_seal_is_left_alone_and_not_taken_for_sealed() {
        for text in ["", "\"seal\":\"", "\"seal\":\"123\"", "nothing"] {
            let mut bytes = text.as_bytes().to_vec();
            set_seal(&mut bytes);
            assert_eq!(bytes, text.as_bytes());
            assert!(!is_sealed(bytes));
        }
    }
}
