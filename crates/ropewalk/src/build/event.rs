//! Split events: where fragments start and end along an axis.

/// What happens to a fragment at an event, in the order in which a sweep meets ties.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum EventKind {
    /// The fragment ends here.
    End = 0,
    /// The fragment lies in the plane.
    Planar = 1,
    /// The fragment starts here.
    Start = 2,
}

/// One event in eight bytes, ordered as an integer.
///
/// ```text
///   bits 63..32                       31..30   29..0
///   position, bits in integer order   kind     fragment of the node
/// ```
/// Integer order is the order by position, then End < Planar < Start, then fragment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Event(u64);

const ID_BITS: u32 = 30;
const ID_MASK: u64 = (1 << ID_BITS) - 1;
const SIGN: u32 = 1 << 31;

impl Event {
    /// `position` must be finite and not -0, `fragment` below 2^30.
    #[inline]
    pub fn new(position: f32, kind: EventKind, fragment: u32) -> Self {
        debug_assert!(u64::from(fragment) <= ID_MASK && position.is_finite());
        let bits = position.to_bits();
        let ordered = if bits & SIGN == 0 { bits | SIGN } else { !bits };
        Event(u64::from(ordered) << 32 | u64::from(kind as u32) << ID_BITS | u64::from(fragment))
    }

    /// The position as an integer in the same order: equal keys are equal positions.
    #[inline]
    pub fn position_key(self) -> u32 {
        (self.0 >> 32) as u32
    }

    #[inline]
    pub fn position(self) -> f32 {
        let ordered = self.position_key();
        f32::from_bits(if ordered & SIGN == 0 { !ordered } else { ordered & !SIGN })
    }

    /// The kind as an index: 0 End, 1 Planar, 2 Start.
    #[inline]
    pub fn kind_index(self) -> usize {
        (self.0 >> ID_BITS & 3) as usize
    }

    #[inline]
    pub fn fragment(self) -> u32 {
        (self.0 & ID_MASK) as u32
    }

    /// The same event of a renumbered fragment.
    #[inline]
    pub fn renumbered(self, fragment: u32) -> Self {
        Event(self.0 & !ID_MASK | u64::from(fragment))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integer_order_is_position_then_kind_then_fragment() {
        use EventKind::*;
        let positions = [f32::MIN, -1.5, -1e-45, 0.0, 1e-45, 2.0, f32::MAX];
        let mut events = Vec::new();
        for p in positions {
            for kind in [End, Planar, Start] {
                for id in [0, 7, (1 << 30) - 1] {
                    let event = Event::new(p, kind, id);
                    assert_eq!((event.position(), event.fragment()), (p, id));
                    assert_eq!(event.kind_index(), kind as usize);
                    assert_eq!(event.renumbered(3), Event::new(p, kind, 3));
                    events.push(event);
                }
            }
        }
        assert!(events.is_sorted());
    }
}
