//! What readers leave out, one sentence a kind.

/// Kinds that are kept, at most: a hostile file names many.
const MOST: usize = 100;

/// Kinds in the order in which they were met, with how often.
#[derive(Default)]
pub struct Skipped {
    kinds: Vec<(String, usize)>,
    more: usize,
}

impl Skipped {
    /// Notes one thing of this kind.
    pub fn note(&mut self, what: impl Into<String>) {
        self.note_many(what, 1);
    }

    /// Notes so many things of this kind.
    pub fn note_many(&mut self, what: impl Into<String>, count: usize) {
        let what = what.into();
        if let Some((_, seen)) = self.kinds.iter_mut().find(|(kind, _)| *kind == what) {
            *seen += count;
        } else if self.kinds.len() < MOST {
            self.kinds.push((what, count));
        } else {
            self.more += count;
        }
    }

    /// One sentence a kind, with the count where there is more than one.
    pub fn sentences(self) -> Vec<String> {
        let sentence = |(what, count): (String, usize)| {
            let text = super::error::printable(&what, 400);
            if count > 1 { format!("{text} ({count})") } else { text }
        };
        let mut all: Vec<String> = self.kinds.into_iter().map(sentence).collect();
        if self.more > 0 {
            all.push(format!("{} more", self.more));
        }
        all
    }
}
