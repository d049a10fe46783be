//! A spatial index: numbers of things in square buckets, so that those near a place are found without a search through
//! all.

/// The numbers of the things in each square bucket of a raster.
#[derive(Debug)]
pub(super) struct Buckets {
    cols: i64,
    rows: i64,
    /// One list for each bucket, row by row.
    numbers: Vec<Vec<u32>>,
}

impl Buckets {
    /// Creates empty buckets.
    pub fn new(cols: i64, rows: i64) -> Buckets {
        Buckets { cols, rows, numbers: vec![Vec::new(); (cols * rows) as usize] }
    }

    /// Puts a number into all buckets from column and row `first` to `last`.
    pub fn put(&mut self, number: u32, first: [i64; 2], last: [i64; 2]) {
        for bucket in self.range(first, last) {
            self.numbers[bucket].push(number);
        }
    }

    /// Returns the numbers in a bucket, in the order in which they were put there; none outside the raster.
    pub fn at(&self, bucket: [i64; 2]) -> &[u32] {
        self.range(bucket, bucket).next().map_or(&[], |bucket| &self.numbers[bucket])
    }

    /// Collects in `found` all numbers in the buckets from column and row `first` to `last`, each once, in ascending
    /// order.
    pub fn find(&self, first: [i64; 2], last: [i64; 2], found: &mut Vec<u32>) {
        found.clear();
        for bucket in self.range(first, last) {
            found.extend(&self.numbers[bucket]);
        }
        found.sort_unstable();
        found.dedup();
    }

    /// Returns the indices of the buckets from column and row `first` to `last`, without those outside the raster.
    fn range(&self, first: [i64; 2], last: [i64; 2]) -> impl Iterator<Item = usize> + use<> {
        let cols = self.cols;
        let (columns, rows) = (first[0].max(0)..=last[0].min(cols - 1), first[1].max(0)..=last[1].min(self.rows - 1));
        rows.flat_map(move |row| columns.clone().map(move |col| (row * cols + col) as usize))
    }
}
