//! The words of the command, as they were last read: `INSTA_UPDATE=always cargo test --profile quick --test suite --
//! wording` accepts others.

use crate::desk::Desk;

fn assert_worded(name: &str, text: &str) {
    insta::with_settings!({ prepend_module_to_snapshot => false, omit_expression => true }, {
        insta::assert_snapshot!(name, text);
    });
}

#[test]
fn the_help_of_each_command_is_as_read() {
    let desk = Desk::new();
    let help = desk.done(&["--help"]).stdout;
    assert_worded("terrane", &help);
    let list = help.split("Commands:\n").nth(1).and_then(|rest| rest.split("\n\n").next()).unwrap();
    let names = list.lines().filter_map(|line| line.strip_prefix("  ")).filter(|line| !line.starts_with(' '));
    let names: Vec<&str> = names.filter_map(|line| line.split(' ').next()).filter(|name| *name != "help").collect();
    assert!(names.len() > 20, "{names:?}");
    for name in names {
        assert_worded(name, &desk.done(&[name, "--help"]).stdout);
    }
}

/// Commands that make a mistake each, none of which depends on the machine.
const MISTAKES: &str = "\
bake small.toml --size 0x0
bake small.toml --size 3x0
bake small.toml --size 3
bake small.toml --size -1x2
bake small.toml --size 18446744073709551616x1
bake small.toml --at 9223372036854775808,0
bake small.toml --at 5
bake small.toml --at 9223372036854775807,0
bake small.toml --at -9223372036854775808,0
bake small.toml --at 5,5 --size 18446744073709551615x1
bake small.toml --at 5,5 --size 1x9223372036854775807
bake small.toml --size 1000000000x1000000000
bake small.toml --size 62500x1 --export height
bake small.toml --size 1x134217728 --export map
bake small.toml --size 134217728x1 --export blend
bake small.toml --size 1x134217728 --export normal
bake small.toml --size 134217728x1 --export exr
bake small.toml --size 1400x1400 --export gltf-region
bake small.toml --height-range 0,1e30
bake small.toml --height-range=-3e38,3e38
bake small.toml --height-range 0,1e8
bake small.toml --export gltf --mesh-origin 100.3,50.2
bake small.toml --export hieght
bake small.toml --export height,
bake small.toml --seed -1
bake small.toml --seed 1e3
bake small.toml --threads 0
bake small.toml -q -v
bake small.toml --colour
bake small.toml --bounds=1,0,0,1
bake small.toml --bounds=1,0,2
bake small.toml --around=1,2
bake small.toml --around=1,2,3,4
bake small.toml --bounds=0,0,1e300,1
bake small.toml --around=0,0,1 --at=0,0
bake small.toml --stride 3
bake small.toml --stride 8192
bake small.toml --scale 1:50000
bake small.toml --out small.toml
bake small.toml --out small.toml --overwrite
bake thesis --tile-cells 32
bake thesis --tile-cells 8
bake montains
bake missing.toml
presets zzz
tile small.toml 9223372036854775807 0
tile small.toml 1
map small.toml --scale 1:0
map small.toml --scale 1/4
map small.toml --scale 1:50000 --width 300
map small.toml --dpi 0
map small.toml --bounds=5,5,-5,10
map small.toml --bounds=0,0,1000,1000 --metres-per-pixel 0.01
map small.toml --bounds=0,0,1000,1 --metres-per-pixel 1
map small.toml --around 1e13,0,10
map small.toml --at 9223372036854775807,0
map small.toml --style topografic
map small.toml --style-set relief.sun=3
map small.toml --style-set ink=\"red\"
map small.toml --furniture legends
map small.toml --out map.tiff
map small.toml --overlay hexes
map small.toml --around Nowhere
map small.toml --out map.webp --width 20000 --furniture none
atlas small.toml --sheets 0x2
atlas small.toml --sheets 2x40
atlas small.toml --sheets 2x2 --around=0,0,1
atlas small.toml --sheets 2x2 --size 8x8
atlas small.toml --paper a9
atlas small.toml --overlap 500
atlas small.toml --middle Nowhere
find alps castle
find small.toml lake
find alps lake --radius=-3
find alps lake --near=1e300,0
shard-plan - --engine commands
shard-plan small.toml --engine cron
shard-plan small.toml --engine commands --add
shard-plan small.toml --engine commands --size 2x2 --shards 5
shard-plan small.toml --engine commands --shards 5 --shard-minutes 5
experiment --sizes 8
experiment --sizes 64,5000
experiment --sizes many
experiment --sizes=
experiment --minutes 0
experiment --minutes -1
experiment --minutes nan
experiment --minutes 1e9
experiment --speed 0
experiment --speed -3
experiment --speed 1e6
experiment --device gpuu
experiment --device auto
experiment --device gpu --workgroup 9
experiment --agents maybe
experiment --out small.toml
experiment --threads 0
experiment --threads 1,many
experiment --layers 1,17
experiment --step two
explore -
extend nowhere --size 9x9
registry
registry nowhere
verify nowhere
schema map
completions cmd
";

#[test]
fn mistakes_are_refused_in_the_words_that_were_read() {
    let desk = Desk::new();
    let told = |line: &str| {
        let outcome = desk.refused(&line.split(' ').collect::<Vec<_>>(), &[]);
        assert_eq!(outcome.stdout, "", "{line}");
        format!("$ terrane {line}\n{}\n", outcome.stderr)
    };
    assert_worded("mistakes", &MISTAKES.lines().map(told).collect::<String>());
}
