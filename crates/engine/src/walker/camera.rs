//! The camera of the thesis' experiment: constant speed, and a turn of ninety degrees each minute, in virtual time.

use crate::error::Error;

/// Frames per second of the camera's virtual time. At each frame the camera checks whether it has crossed a tile edge.
pub const FRAMES_A_SECOND: f64 = 60.0;

/// Time in seconds from one turn to the next.
const LEG_S: f64 = 60.0;

/// Heading on the first leg as a unit vector (east, south): thirty degrees off the tiles' axis.
///
/// The thesis does not tell its heading. Along an axis the camera would cross edges of one direction only; with this
/// heading it crosses both directions, and corners too.
const HEADING: [f64; 2] = [0.866_025_403_784_438_6, 0.5];

/// A camera on a fixed route, so that every configuration sees the same walk.
///
/// Its time is virtual: it stops while tiles are made, so a walk of five minutes takes only as long as its tiles.
///
/// Based on: Grelsson (2014), chapter 5.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    start_m: [f64; 2],
    speed_m_s: f64,
}

impl Camera {
    /// Longest duration of a walk in minutes.
    pub const MOST_MINUTES: f64 = 1440.0;

    /// Checks the duration and speed of a walk over tiles that are `tile_m` metres wide.
    ///
    /// # Errors
    /// When the duration is not above 0 or is too long, when the speed is not above 0, or when it is faster than a tile
    /// per frame; the hint names values that are allowed.
    pub fn check(minutes: f64, speed_m_s: f64, tile_m: f64) -> Result<(), Error> {
        let refuse = |message: String, hint: String| Err(Error::Option { message, hint });
        if !(minutes > 0.0 && minutes <= Camera::MOST_MINUTES) {
            return refuse(
                format!("a walk cannot take {minutes} minutes"),
                format!("give more than 0 and at most {}, such as 5", Camera::MOST_MINUTES),
            );
        }
        // At a higher speed one expansion could be several tiles deep.
        let fastest_m_s = tile_m * FRAMES_A_SECOND;
        if !(speed_m_s > 0.0 && speed_m_s <= fastest_m_s) {
            return refuse(
                format!("a camera cannot walk tiles of {tile_m} m at {speed_m_s} metres a second"),
                format!("give more than 0 and at most {fastest_m_s}, a tile a frame, such as 128"),
            );
        }
        Ok(())
    }

    /// Creates a camera that starts at `start_m`, in metres east and south, and moves at `speed_m_s` metres a second.
    pub fn new(start_m: [f64; 2], speed_m_s: f64) -> Camera {
        Camera { start_m, speed_m_s }
    }

    /// Returns the camera's position after `time_s` seconds in metres east and south. Before the start it is the start.
    pub fn position_m(&self, time_s: f64) -> [f64; 2] {
        let time_s = time_s.max(0.0);
        let whole_legs = (time_s / LEG_S).floor();
        // Four legs form a square that ends where it began, so only the legs since the last full square count.
        let legs = (whole_legs % 4.0) as usize;
        let mut position = self.start_m;
        let mut heading = HEADING;
        let lengths_s = std::iter::repeat_n(LEG_S, legs).chain([time_s - whole_legs * LEG_S]);
        for length_s in lengths_s {
            for (axis, towards) in position.iter_mut().zip(heading) {
                *axis += towards * self.speed_m_s * length_s;
            }
            // Turns to the right: from east to south.
            heading = [-heading[1], heading[0]];
        }
        position
    }

    /// Lists the camera's positions at each frame of a walk of this many minutes, including the start.
    pub fn places_m(self, minutes: f64) -> impl Iterator<Item = [f64; 2]> {
        let frames = (minutes * 60.0 * FRAMES_A_SECOND).round() as u64;
        (0..=frames).map(move |frame| self.position_m(frame as f64 / FRAMES_A_SECOND))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distance([ax, ay]: [f64; 2], [bx, by]: [f64; 2]) -> f64 {
        (ax - bx).hypot(ay - by)
    }

    #[test]
    fn it_goes_at_its_speed_and_turns_each_minute() {
        let camera = Camera::new([32.0, 32.0], 10.0);
        assert_eq!(camera.position_m(0.0), [32.0, 32.0]);
        assert_eq!(camera.position_m(-5.0), [32.0, 32.0]);
        // Within a leg the distance is time times speed.
        assert!((distance(camera.position_m(7.0), camera.position_m(52.0)) - 450.0).abs() < 1e-9);
        // Around a corner the way is the two sides of a right angle.
        let around = distance(camera.position_m(57.0), camera.position_m(64.0));
        assert!((around - f64::hypot(30.0, 40.0)).abs() < 1e-9, "{around}");
        // Turns to the right: east, then south, then west.
        let [a, b, c] = [0.0, 60.0, 120.0].map(|time_s| camera.position_m(time_s));
        assert!(b[0] > a[0] && b[1] > a[1] && c[0] < b[0] && c[1] > b[1], "{a:?} {b:?} {c:?}");
    }

    #[test]
    fn four_minutes_are_a_square_and_the_fifth_is_the_first_again() {
        let camera = Camera::new([-7.0, 3.0], 128.0);
        for time_s in [0.0, 13.5, 59.9] {
            let apart = distance(camera.position_m(time_s), camera.position_m(time_s + 240.0));
            assert!(apart < 1e-8, "{apart} m apart at {time_s} s");
        }
    }
}
