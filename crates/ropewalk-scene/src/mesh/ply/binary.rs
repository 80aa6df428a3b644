//! Elements of binary files that are read many at once.

use super::super::Watched;
use super::super::error::{Place, Result};
use super::super::input::Input;
use super::super::soup::Soup;
use super::header::{Element, Property, Scalar, Use};
use super::{Row, cut_off, out_of_range};

/// Elements of numbers alone: where in each record what stands.
pub struct Record {
    pub size: usize,
    pub fields: Vec<(usize, Scalar, Use)>,
}

impl Record {
    /// `None` if the element has lists.
    pub fn of(element: &Element, wants_looks: bool) -> Option<Record> {
        let (mut size, mut fields) = (0, Vec::new());
        for Property { count, item, role, .. } in &element.properties {
            if count.is_some() {
                return None;
            }
            if matches!(role, Use::Axis(_)) || wants_looks && *role != Use::Nothing {
                fields.push((size, *item, *role));
            }
            size += item.bytes();
        }
        Some(Record { size, fields })
    }
}

pub fn read_records(
    plan: &Record,
    count: u64,
    input: &mut Input<'_>,
    is_big: bool,
    soup: &mut Soup,
    limits: &Watched<'_>,
) -> Result<()> {
    let (size, mut left) = (plan.size, count);
    while left > 0 {
        let at = input.at();
        let ahead = input.ahead(size)?;
        let here = ((ahead.len() / size) as u64).min(left) as usize;
        if here == 0 {
            return Err(cut_off(input, "a number"));
        }
        for (i, record) in ahead[..here * size].chunks_exact(size).enumerate() {
            let mut row = Row::default();
            for &(offset, kind, role) in &plan.fields {
                row.set(role, kind, kind.value(&record[offset..], is_big));
            }
            row.push(|| Place::Byte(at + (i * size) as u64), soup, limits)?;
        }
        input.skip(here * size);
        left -= here as u64;
    }
    Ok(())
}

/// Faces with a list of 32-bit integers behind a byte, and numbers before and behind that are passed over.
pub struct Faces {
    pub before: usize,
    pub behind: usize,
    pub is_big: bool,
    pub vertices: u64,
}

pub fn read_faces(
    plan: &Faces,
    count: u64,
    input: &mut Input<'_>,
    soup: &mut Soup,
    limits: &Watched<'_>,
) -> Result<()> {
    let &Faces { before, behind, is_big, vertices } = plan;
    let mut left = count;
    while left > 0 {
        let start = input.at();
        let ahead = input.ahead(before + 1 + 4 * 255 + behind)?;
        let mut at = 0;
        while left > 0 {
            let Some(&corners) = ahead.get(at + before) else {
                break;
            };
            let list = at + before + 1;
            let end = list + 4 * usize::from(corners);
            let Some(indices) = ahead.get(list..end).filter(|_| end + behind <= ahead.len()) else {
                break;
            };
            for (i, &bytes) in indices.as_chunks::<4>().0.iter().enumerate() {
                // Negative ones are beyond every count.
                let index =
                    if is_big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) };
                if u64::from(index) >= vertices {
                    let place = Place::Byte(start + (list + 4 * i + 4) as u64);
                    return Err(out_of_range(place, vertices, index));
                }
                soup.open.push(index);
            }
            soup.end_polygon(|| Place::Byte(start + end as u64), limits)?;
            at = end + behind;
            left -= 1;
        }
        if at == 0 && left > 0 {
            return Err(cut_off(input, "a number of a list"));
        }
        input.skip(at);
    }
    Ok(())
}
