//! What readers leave out, one sentence a kind.

/// Kinds that are kept, at most: a hostile file names many.
const MOST: usize = 100;

/// Names that a sentence lists, at most.
const NAMES: usize = 3;

/// Kinds in the order in which they were met, with how often.
#[derive(Default)]
pub struct Skipped {
    kinds: Vec<Kind>,
    more: usize,
}

struct Kind {
    what: String,
    count: usize,
    /// The first ones, where they have names.
    names: Vec<String>,
}

impl Skipped {
    /// Notes one thing of this kind.
    pub fn note(&mut self, what: impl Into<String>) {
        self.note_many(what, 1);
    }

    /// Notes so many things of this kind.
    pub fn note_many(&mut self, what: impl Into<String>, count: usize) {
        let what = what.into();
        if let Some(kind) = self.kinds.iter_mut().find(|kind| kind.what == what) {
            kind.count += count;
        } else if self.kinds.len() < MOST {
            self.kinds.push(Kind { what, count, names: Vec::new() });
        } else {
            self.more += count;
        }
    }

    /// Notes one thing of this kind that has a name.
    pub fn note_named(&mut self, what: &str, name: &str) {
        self.note(what);
        let kind = self.kinds.iter_mut().find(|kind| kind.what == what);
        if let Some(kind) = kind.filter(|kind| kind.names.len() < NAMES) {
            kind.names.push(name.chars().take(100).collect());
        }
    }

    /// One sentence a kind, with the count where there is more than one.
    pub fn sentences(self) -> Vec<String> {
        let sentence = |Kind { what, count, names }: Kind| {
            let more = count - names.len();
            let text = match &names[..] {
                [] if count > 1 => format!("{what} ({count})"),
                [] => what,
                names if more > 0 => format!("{what}: {} and {more} more", names.join(", ")),
                names => format!("{what}: {}", names.join(", ")),
            };
            super::error::printable(&text, 500)
        };
        let mut all: Vec<String> = self.kinds.into_iter().map(sentence).collect();
        if self.more > 0 {
            all.push(format!("{} more", self.more));
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_sentence_a_kind() {
        let mut skipped = Skipped::default();
        ["a", "b", "c", "d\n", "e"].iter().for_each(|name| skipped.note_named("files", name));
        skipped.note("lines");
        skipped.note_many("points", 7);
        skipped.note_named("one", "x\ty");
        let expected = ["files: a, b, c and 2 more", "lines", "points (7)", "one: x\\ty"];
        assert_eq!(skipped.sentences(), expected);
        let mut many = Skipped::default();
        (0..MOST + 5).for_each(|i| many.note(i.to_string()));
        assert_eq!(many.sentences().last().unwrap(), "5 more");
    }
}
