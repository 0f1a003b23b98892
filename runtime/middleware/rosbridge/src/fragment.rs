//! Operations in pieces: where a peer limits the length of frames.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use crate::operation::Operation;

/// Cuts a text into pieces of at most so many bytes, as operations of their own; the text itself if it is short enough.
/// A piece holds at least one character, and no character is cut.
pub fn cut(id: &str, text: &str, most: usize) -> Vec<Operation> {
    let mut pieces: Vec<&str> = Vec::new();
    let mut rest = text;
    while !rest.is_empty() {
        let mut end = most.min(rest.len()).max(1);
        while !rest.is_char_boundary(end) {
            end = if end > most { end + 1 } else { end - 1 };
            if end == 0 {
                end = rest.chars().next().map_or(0, char::len_utf8);
            }
        }
        let (piece, after) = rest.split_at(end);
        pieces.push(piece);
        rest = after;
    }
    let total = u32::try_from(pieces.len()).unwrap_or(u32::MAX);
    let piece = |(num, data): (u32, &str)| Operation::Fragment { id: id.to_owned(), data: data.to_owned(), num, total };
    (0u32..).zip(pieces).map(piece).collect()
}

/// Pieces that wait for others.
#[derive(Debug, Default)]
pub struct Pieces {
    /// By id.
    waiting: BTreeMap<String, Waiting>,
    /// Bytes that wait.
    bytes: usize,
    /// Counts arrivals, to know what waits longest.
    arrivals: u64,
}

#[derive(Debug)]
struct Waiting {
    total: u32,
    pieces: BTreeMap<u32, String>,
    /// When the last piece came.
    at: u64,
}

/// Why a piece is useless.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PieceError {
    /// Its number is not one of so many.
    #[error("a fragment has number {num} of {total}")]
    Number {
        /// The number.
        num: u32,
        /// How many there are said to be.
        total: u32,
    },
    /// Pieces of one operation say different things.
    #[error("the fragments of `{id}` do not agree on how many there are")]
    Total {
        /// Their id.
        id: String,
    },
    /// The whole would be too long.
    #[error("the fragments of `{id}` are longer than {most} bytes")]
    Long {
        /// Their id.
        id: String,
        /// The most.
        most: usize,
    },
}

impl Pieces {
    /// Takes a piece; gives the whole once it is complete. At most `most` bytes wait: what waited longest is given up
    /// for new ones. If a piece comes twice, the first counts.
    pub fn take(
        &mut self,
        id: &str,
        data: &str,
        (num, total): (u32, u32),
        most: usize,
    ) -> Result<Option<String>, PieceError> {
        if num >= total {
            return Err(PieceError::Number { num, total });
        }
        self.arrivals += 1;
        let at = self.arrivals;
        let waiting =
            self.waiting.entry(id.to_owned()).or_insert_with(|| Waiting { total, pieces: BTreeMap::new(), at });
        if waiting.total != total {
            self.give_up(id);
            return Err(PieceError::Total { id: id.to_owned() });
        }
        waiting.at = at;
        if let Entry::Vacant(place) = waiting.pieces.entry(num) {
            self.bytes += data.len() + PER_PIECE;
            place.insert(data.to_owned());
        }
        let own: usize = waiting.pieces.values().map(|piece| piece.len() + PER_PIECE).sum();
        if own > most {
            self.give_up(id);
            return Err(PieceError::Long { id: id.to_owned(), most });
        }
        if waiting.pieces.len() == total as usize {
            let whole = waiting.pieces.values().map(String::as_str).collect();
            self.give_up(id);
            return Ok(Some(whole));
        }
        while self.bytes > most {
            let oldest = self.waiting.iter().min_by_key(|(_, waiting)| waiting.at).map(|(id, _)| id.clone());
            let Some(oldest) = oldest else { break };
            self.give_up(&oldest);
        }
        Ok(None)
    }

    fn give_up(&mut self, id: &str) {
        if let Some(gone) = self.waiting.remove(id) {
            let bytes: usize = gone.pieces.values().map(|piece| piece.len() + PER_PIECE).sum();
            self.bytes = self.bytes.saturating_sub(bytes);
        }
    }
}

/// What a piece costs besides its text, so that empty ones cannot fill the memory.
const PER_PIECE: usize = 64;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn parts(operation: Operation) -> (String, String, u32, u32) {
        match operation {
            Operation::Fragment { id, data, num, total } => (id, data, num, total),
            other => panic!("{other:?}"),
        }
    }

    proptest! {
        #[test]
        fn pieces_in_any_order_are_the_whole(
            text in "[a-zä漢🤖\"\\\\]{1,60}", most in 1usize..12, order in any::<prop::sample::Index>(),
        ) {
            let mut pieces: Vec<_> = cut("x", &text, most).into_iter().map(parts).collect();
            prop_assert!(pieces.iter().all(|(_, data, ..)| data.len() <= most.max(4)));
            let turn = order.index(pieces.len());
            pieces.rotate_left(turn);
            let mut waiting = Pieces::default();
            let last = pieces.len() - 1;
            for (at, (id, data, num, total)) in pieces.into_iter().enumerate() {
                let whole = waiting.take(&id, &data, (num, total), 1 << 20).unwrap();
                prop_assert_eq!(whole.as_deref(), (at == last).then_some(text.as_str()));
            }
            prop_assert_eq!(waiting.bytes, 0);
        }

        #[test]
        fn no_pieces_keep_more_than_they_may(
            pieces in prop::collection::vec(("[a-d]", "[a-z]{0,40}", 0u32..6, 1u32..6), 0..80), most in 100usize..600,
        ) {
            let mut waiting = Pieces::default();
            for (id, data, num, total) in pieces {
                let _ = waiting.take(&id, &data, (num, total), most);
                prop_assert!(waiting.bytes <= most);
                let kept: usize = waiting.waiting.values().flat_map(|message| message.pieces.values()).map(|piece| piece.len() + PER_PIECE).sum();
                prop_assert_eq!(kept, waiting.bytes);
            }
        }
    }

    #[test]
    fn wrong_pieces_are_refused_and_forgotten() {
        let mut waiting = Pieces::default();
        assert_eq!(waiting.take("a", "x", (2, 2), 1000), Err(PieceError::Number { num: 2, total: 2 }));
        assert_eq!(waiting.take("a", "x", (0, 3), 1000), Ok(None));
        assert_eq!(waiting.take("a", "x", (0, 3), 1000), Ok(None), "twice counts once");
        assert_eq!(waiting.take("a", "y", (1, 2), 1000), Err(PieceError::Total { id: "a".to_owned() }));
        let long = "z".repeat(2000);
        assert_eq!(waiting.take("b", &long, (0, 2), 1000), Err(PieceError::Long { id: "b".to_owned(), most: 1000 }));
        assert_eq!((waiting.bytes, waiting.waiting.len()), (0, 0));
    }
}
