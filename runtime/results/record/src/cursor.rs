//! Rows of several tables side by side, test by test.

use rusqlite::{Row, Rows};

/// Rows of a table that are in the order of tests, taken test by test.
pub(super) struct Cursor<'s, T> {
    rows: Rows<'s>,
    read: fn(&Row<'_>) -> rusqlite::Result<T>,
    next: Option<(u32, T)>,
    /// A test whose rows were skipped, since nothing asked for it.
    passed_over: Option<u32>,
}

impl<'s, T> Cursor<'s, T> {
    /// The first column of each row is its test.
    pub(super) fn over(rows: Rows<'s>, read: fn(&Row<'_>) -> rusqlite::Result<T>) -> rusqlite::Result<Self> {
        let mut cursor = Cursor { rows, read, next: None, passed_over: None };
        cursor.step()?;
        Ok(cursor)
    }

    fn step(&mut self) -> rusqlite::Result<()> {
        self.next = match self.rows.next()? {
            Some(row) => Some((row.get(0)?, (self.read)(row)?)),
            None => None,
        };
        Ok(())
    }

    /// The rows of a test; tests are asked for in ascending order.
    pub(super) fn of(&mut self, test: u32) -> rusqlite::Result<Vec<T>> {
        let mut found = Vec::new();
        while let Some((owner, item)) = self.next.take() {
            if owner > test {
                self.next = Some((owner, item));
                break;
            }
            if owner == test {
                found.push(item);
            } else {
                self.passed_over = Some(owner);
            }
            self.step()?;
        }
        Ok(found)
    }

    /// A test that has rows here, and that was not asked for.
    pub(super) fn orphan(&self) -> Option<u32> {
        self.passed_over.or(self.next.as_ref().map(|(owner, _)| *owner))
    }
}
