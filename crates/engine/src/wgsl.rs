//! Structs and constants that Rust shares with the shaders in `shaders/`. They are written in Rust alone; the shaders get
//! them as a text of WGSL.

use bytemuck::{Pod, cast_slice};

/// Declares structs of 32-bit words, each with the buffer that kernels read it from and a constant for its number of
/// words; and a function `wgsl` that returns them and further constants as WGSL, with the same names.
macro_rules! kernel_words {
    (
        $($(#[$note:meta])* struct $name:ident in $buffer:ident, $words:ident { $($field:ident: $kind:ty),+ $(,)? })+
        $(const $($constant:ident: $number:ident),+ $(,)?;)?
    ) => {
        $(
            $(#[$note])*
            #[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
            #[repr(C)]
            pub(crate) struct $name { $(pub(crate) $field: $kind),+ }

            pub(crate) const $words: usize = size_of::<$name>() / 4;
        )+

        pub(crate) fn wgsl() -> String {
            let mut text = String::new();
            $(
                let fields = [$((stringify!($field), stringify!($kind), std::mem::offset_of!($name, $field) / 4)),+];
                text += &$crate::wgsl::structure(stringify!($name), stringify!($buffer), &fields);
                text += &format!("const {}: u32 = {};\n", stringify!($words), $words);
            )+
            $($(text += &format!("const {}: {} = {:?};\n", stringify!($constant), stringify!($number), $constant as $number);)+)?
            text
        }
    };
}

/// Returns a struct as WGSL, with a function `<buffer>_<name>` that reads it from a word on of a buffer. Fields are
/// given as name, type and first word. Of an array of more than four words there is only the offset, as a constant with
/// the name of the field in capitals.
pub fn structure(name: &str, buffer: &str, fields: &[(&str, &str, usize)]) -> String {
    let (mut members, mut values, mut offsets) = (Vec::new(), Vec::new(), Vec::new());
    for (field, kind, at) in fields {
        // `[f32; 2]` of Rust is `vec2f` in WGSL.
        let (number, count) = kind.trim_matches(['[', ']']).split_once("; ").unwrap_or((kind, "1"));
        match count.parse::<usize>() {
            Ok(1) => {
                members.push(format!("{field}: {number}"));
                values.push(format!("bitcast<{number}>({buffer}[at + {at}])"));
            }
            Ok(count @ 2..=4) => {
                let vector = format!("vec{count}{}", &number[..1]);
                members.push(format!("{field}: {vector}"));
                let words = (*at..at + count).map(|at| format!("{buffer}[at + {at}]")).collect::<Vec<_>>().join(", ");
                values.push(format!("bitcast<{vector}>(vec{count}u({words}))"));
            }
            _ => offsets.push(format!("const {}: u32 = {at};\n", field.to_uppercase())),
        }
    }
    let (members, values, offsets) = (members.join(", "), values.join(", "), offsets.concat());
    format!(
        "{offsets}struct {name} {{ {members} }}\nfn {buffer}_{name}(at: u32) -> {name} {{ return {name}({values}); }}\n"
    )
}

/// Appends the words of a struct, or of another plain value.
pub fn push<T: Pod>(words: &mut Vec<u32>, value: T) {
    words.extend_from_slice(cast_slice(&[value]));
}
