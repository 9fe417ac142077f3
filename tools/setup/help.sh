# Sourced by ./breakshot: its help texts.

help_all() {
  cat <<'TEXT'
breakshot: a robot cell that singulates discs by hitting and pushing them.

  ./breakshot demo      install, build, singulate the rack in the simulated cell, show the result
  ./breakshot test      install, build, run all tests

  setup                 install what is missing (Debian packages, ruckig, Python for the tests)
  build [PRESET]        build: release (default), debug, asan, tsan, coverage
  up, down, status      start the cell and leave it running; take it down; see how it does
  order, stop           send an order to the running cell and follow it; cancel it
  recover               end a stop of the controller: until then no order is taken and nothing moves
  bench [NAME]          run a benchmark; without a name: list them
  plot                  draw what a benchmark of strategies or of strokes wrote
  perceive, render      run perception on an image; render an image of a formation
  calibrate             find where the camera is from pictures of a ChArUco board; print such a board
  fuzz [NAME]           throw broken files and frames at the readers
  replay FILE           feed a flight record of the controller through its control loop again
  clean [--all]         remove the builds; with --all also what was fetched

  ./breakshot COMMAND --help   explains one command. README.md is the way in, docs/architecture.md the map.
TEXT
}

# What the program behind a command says of its own options, if it is built.
program_help() {
  local program=$root/build/release/bin/breakshot-$1
  shift
  [ -x "$program" ] || return 0
  printf '\nOptions of the program behind it:\n'
  "$program" "$@" --help | sed 's/^/  /'
}

help_for() {
  case $1 in
    '') help_all ;;
    setup) cat <<'TEXT'
./breakshot setup

Installs what building, running and testing need, and only what is missing:
  Debian packages   tools/setup/packages.txt, by apt-get (as root or through sudo)
  ruckig            pinned source distribution from PyPI, built into build/deps, unless CMake finds one on the system
  build/venv        pinned Python packages for the interoperability tests
When all is there it needs no network and takes well under a second. Every other command does its part of this by itself.
TEXT
      ;;
    build) cat <<'TEXT'
./breakshot build [PRESET]

Builds everything of a preset into build/PRESET:
  release    optimised; what demo, up and bench run (default)
  debug      no optimisation, library assertions
  asan       AddressSanitizer and UndefinedBehaviorSanitizer
  tsan       ThreadSanitizer
  coverage   instrumented for gcov
TEXT
      ;;
    demo) cat <<'TEXT'
./breakshot demo [options]

Starts the whole cell (simulator, controller, perception, planner, gateway) in the foreground, sends the order to singulate what lies on the
table, shows a line per stroke and a table at the end, and takes the cell down. Exits with 0 only if all discs were singulated and none was lost.

  --formation NAME     what lies on the table: A to F, fig11 (default: a rack with a cue disc), fig12, fig13, or random
  --n 8 --seed 3       a random touching cluster of so many discs; the seed says which (they imply --formation random)
  --radius-min, --radius-max M   radii of its discs, in metres
  --strategy NAME      paper (hits, then pushes, by the paper's rule), robust (over many worlds), random_hybrid, random_push
  --out FOLDER         where before.png, after.png, decision-NN.png and run.json go; default: run/demo/<time>
  --config FILE        the cell's configuration; default: config/cell.yaml
  --set KEY=VALUE      overrides one value of it, e.g. --set planner.strategy=paper (repeatable)
  --with ros_gateway   also publishes standard ROS 2 topics
  --verbose            shows the logs of all processes, each behind its name
TEXT
      ;;
    test) cat <<'TEXT'
./breakshot test [FILTER] [--label LABEL] [--preset PRESET]

Installs, builds and runs the tests; closes with "N passed, N failed".
  FILTER            only tests whose names match this regular expression, e.g. ./breakshot test launcher
  --label LABEL     unit (fast, no cell), hil (whole cell, real processes), slow
  --preset PRESET   another build: debug, asan, tsan, coverage
TEXT
      ;;
    up) cat <<'TEXT'
./breakshot up [options]

Starts the cell in the background and returns when every process is READY. Logs: run/log. A second `up` says that it is already up.
Options: --set KEY=VALUE, --with ros_gateway, --without NAME, --log-level LEVEL.
TEXT
      ;;
    down) cat <<'TEXT'
./breakshot down

Takes down the cell that `up` started: arm at rest, processes ended in reverse order, shared memory removed. Says so when none is up.
TEXT
      ;;
    status) cat <<'TEXT'
./breakshot status [--json]

Shows each process with its state, CPU share, memory and restarts, and what each says of its own health.
Exit status: 0 up, 3 not up, 1 something is wrong.
TEXT
      ;;
    order)
      cat <<'TEXT'
./breakshot order [options]

Sends an order to the running cell over the factory's interface and follows it to its end. Ctrl-C cancels it.
TEXT
      program_help client order ;;
    stop) cat <<'TEXT'
./breakshot stop

Cancels the order that the running cell works on; the arm finishes its stroke and parks.
TEXT
      ;;
    recover) cat <<'TEXT'
./breakshot recover

After a protective stop, a lost bridge, a collision or another cause of docs/controller.md the cell takes no order and nothing moves until somebody says
that it may go on. That is this command: look at the cell first. It says which causes it ended, or what still stands in the way. Nothing moves; the next order does.
Exit status: 0 nothing is stopped any more, 2 something stands in the way, 3 no answer.
TEXT
      ;;
    bench) cat <<'TEXT'
./breakshot bench [NAME] [options] [--json OUT]

Runs a benchmark: prints a table for people, and with --json writes one JSON object. Without a NAME it lists the benchmarks.
  rt           the control loop: 10^7 ticks under watch, round trip beside bare Fast DDS, wake-up beside cyclictest, idle and under stress-ng;
               some ten minutes; as root, or with the right to SCHED_FIFO and locked memory
  ik           inverse kinematics beside KDL's solvers
  strokes      planned strokes: accuracy, limits, time beside lower bounds
  paper        the paper's strategy and its baselines over whole episodes in the in-process cell
  singulation  strategies in pairs over worlds drawn by the whole protocol: statistics, every episode and stroke in a CSV
  prediction   the planner's virtual world, told everything, beside the simulator: how far resting places are off, and what that is due to
  cell         the same episodes through the real processes in real time and through the in-process cell
  world        the planner's virtual world beside ODE and Box2D
  perception   finding discs in rendered pictures
  camera       what a rendered frame costs
Each says its options with: ./breakshot bench NAME -- --help
TEXT
      ;;
    plot) cat <<'TEXT'
./breakshot plot [--episodes CSV] [--strokes CSV] [--tables JSON [--strategy NAME]] [--map JSON] [--out FOLDER]

Draws what ./breakshot bench singulation (or paper) wrote with --csv, --strokes-csv and --tables: mean times beside the paper's, their distribution, strokes, how
well P(singulated) was predicted, what was learnt of mu and e, and the failed, slowest and median episodes stroke by stroke; and the map over the workspace of
./breakshot bench strokes --json. Installs matplotlib into build/plots-venv the first time.
TEXT
      ;;
    fuzz) cat <<'TEXT'
./breakshot fuzz [NAME...] [--minutes M]

Runs fuzzers (libFuzzer with AddressSanitizer and UndefinedBehaviorSanitizer), each for M minutes (10) on one core at low priority. Ends with the first finding,
whose input is kept in build/fuzz/found. Installs clang 14 for this the first time. docs/testing.md says more.
  image_file      PNG and JPEG, as perceive and calibrate read them
  frame           camera frames as perception takes them from the wire, to the scene
  camera_file     config/cameras
  cell_file       config/cell.yaml and --set
  urdf_file       config/arms
  formation_file  config/formations, and specs of random clusters
TEXT
      ;;
    perceive | render | calibrate)
      case $1 in
        calibrate) cat <<'TEXT'
./breakshot calibrate --images FOLDER --out CAMERA.yaml [options]

Finds where the camera is, and with --intrinsics what its lens does, from pictures of a ChArUco board that lies on the table at a stated place, or that the
arm holds (--joints). Says how large the residuals are and how sure the result is; refuses a poor one with the reason. docs/calibration.md goes through it.
TEXT
          ;;
        perceive) say "./breakshot perceive ...: runs perception on an image and shows what it sees." ;;
        render) say "./breakshot render ...: renders what the simulated camera sees of a formation." ;;
      esac
      program_help "$1" ;;
    replay)
      cat <<'TEXT'
./breakshot replay FILE [--csv TABLE]

The controller writes the last seconds of its loop to run/flight at every stop, refusal and fault (docs/controller.md). This feeds such a file through the
same control loop: shows what it decided and when, and checks that every command comes out the same, bit for bit. If not, it names the first difference.
TEXT
      program_help replay ;;
    clean) cat <<'TEXT'
./breakshot clean [--all]

Takes the cell down and removes the builds and run/. With --all also what was fetched (build/deps, build/venv): the next build then needs the network.
TEXT
      ;;
    *) fail "there is no command \"$1\"" "./breakshot --help" ;;
  esac
}
