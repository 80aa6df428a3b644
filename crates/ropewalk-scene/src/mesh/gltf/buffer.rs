//! Buffers: bytes in the file, beside it, or none.

use super::super::beside::Beside;
use super::super::error::{Place, Result, wrong};
use super::{array, integer, part};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;
use std::borrow::Cow;

/// The buffers of a file.
pub struct Buffers<'a> {
    /// `None` for buffers without bytes, which are refused once they are asked for.
    all: Vec<Option<Cow<'a, [u8]>>>,
}

impl<'a> Buffers<'a> {
    /// All of them; `bin` is the first one of a binary file.
    pub fn load(json: &Value, bin: Option<&'a [u8]>, beside: &Beside<'_>) -> Result<Self> {
        let mut all = Vec::new();
        for (i, buffer) in array(json, "buffers").iter().enumerate() {
            let name = format!("buffers[{i}]");
            let length = integer(buffer, "byteLength", &name)?.unwrap_or(0);
            let bytes =
                match buffer["uri"].as_str() {
                    None => bin.filter(|_| i == 0).map(Cow::Borrowed),
                    Some(uri) => Some(Cow::Owned(fetch(uri, length, beside).map_err(
                        |(expected, found)| wrong(part(format!("{name}.uri")), expected, found),
                    )?)),
                };
            if let Some(bytes) = bytes.as_ref().filter(|bytes| bytes.len() < length) {
                let what = format!("{length} bytes, as byteLength says");
                return Err(wrong(part(name), what, bytes.len()));
            }
            all.push(bytes);
        }
        Ok(Buffers { all })
    }

    /// Bytes of all.
    pub fn bytes(&self) -> usize {
        self.all.iter().flatten().map(|bytes| bytes.len()).sum()
    }

    /// The bytes of a buffer view.
    pub fn view(&self, view: &Value, name: &str) -> Result<&[u8]> {
        let buffer = integer(view, "buffer", name)?.unwrap_or(usize::MAX);
        let Some(bytes) = self.all.get(buffer) else {
            let what = format!("one of the {} buffers", self.all.len());
            return Err(wrong(part(format!("{name}.buffer")), what, &view["buffer"]));
        };
        let Some(bytes) = bytes else {
            let what = format!("a uri or a binary chunk, since {name} uses it");
            return Err(wrong(part(format!("buffers[{buffer}]")), what, "neither"));
        };
        let start = integer(view, "byteOffset", name)?.unwrap_or(0);
        let length = integer(view, "byteLength", name)?.unwrap_or(0);
        bytes.get(start..).and_then(|rest| rest.get(..length)).ok_or_else(|| {
            let what =
                format!("{length} bytes from {start} on within the buffer's {}", bytes.len());
            wrong(part(name), what, "fewer")
        })
    }
}

/// The JSON and the binary chunk of a GLB file.
pub fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>)> {
    let word = |at: usize| {
        let b = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
    };
    let version = word(4);
    if version != Some(2) {
        let found = version.map_or("the end of the file".into(), |v| v.to_string());
        return Err(wrong(Place::Byte(4), "version 2", found));
    }
    let (mut json, mut bin, mut at) = (None, None, 12);
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let Some(chunk) = bytes.get(at + 8..).and_then(|rest| rest.get(..length)) else {
            let what = format!("a chunk of {length} bytes");
            return Err(wrong(Place::Byte(at as u64), what, bytes.len() - at - 8));
        };
        match &(kind as u32).to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if bin.is_none() => bin = Some(chunk),
            _ => {}
        }
        at += 8 + length;
    }
    if at < bytes.len() {
        let found = format!("{} more bytes", bytes.len() - at);
        return Err(wrong(Place::Byte(at as u64), "the end of the file or a chunk", found));
    }
    Ok((json.ok_or_else(|| wrong(Place::Byte(12), "a JSON chunk", "none"))?, bin))
}

/// The bytes that a URI holds or names: data in base64, or a file in the folder of this one or below. The error is what was
/// expected and what was found.
pub fn fetch(
    uri: &str,
    least: usize,
    beside: &Beside<'_>,
) -> std::result::Result<Vec<u8>, (String, String)> {
    let Some(data) = uri.strip_prefix("data:") else {
        let read = beside.read(&decode_percent(uri), least as u64);
        return read.map_err(|why| (why.expected, why.found));
    };
    let Some((_, text)) = data.split_once(";base64,") else {
        return Err(("data in base64".into(), uri.into()));
    };
    // No longer than the text, which is within the limits.
    STANDARD.decode(text).map_err(|e| ("data in base64".into(), e.to_string()))
}

/// `%20` and its like; what is none stays.
pub fn decode_percent(uri: &str) -> String {
    let (bytes, mut out, mut i) = (uri.as_bytes(), Vec::new(), 0);
    while i < bytes.len() {
        let code = bytes.get(i + 1..i + 3).and_then(|b| std::str::from_utf8(b).ok());
        match code.and_then(|code| u8::from_str_radix(code, 16).ok()) {
            Some(byte) if bytes[i] == b'%' => {
                out.push(byte);
                i += 3;
            }
            _ => {
                out.push(bytes[i]);
                i += 1;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}
