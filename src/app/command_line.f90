!> The command line of igaform, taken apart and checked.
module command_line
  use, intrinsic :: iso_fortran_env, only: compiler_version
  use kinds, only: wp
  use text, only: string_t, strings, read_real, append_text
  use command_options, only: program_arguments, take_count, unknown_option
  use build_info, only: version, git_commit, source_digest
  implicit none
  private

  public :: command_t, read_command_line, parse_arguments, usage_text, version_text

  !> What the user asked for.
  type :: command_t
    character(:), allocatable :: deck      !! path, empty where none is needed
    character(:), allocatable :: output    !! path of the result file, empty: from the deck's name
    character(:), allocatable :: restart   !! checkpoint to continue from, empty: none
    logical :: is_any_build = .false.      !! which another build of the program may have written
    real(wp) :: wall_minutes = 0.0_wp      !! of --wall; 0: no limit
    integer :: n_threads = 0               !! 0: as many as OpenMP gives
    integer :: n_to_rebalance = 0          !! increments of --rebalance; 0: as the program sees fit
    type(string_t), allocatable :: overrides(:)   !! name=value of --set
    type(string_t), allocatable :: user_files(:)  !! of --user: sources or libraries
    logical :: is_material = .false.       !! tests of one material point instead of a forming run
    integer :: n_modes = 0                 !! of --modes; 0: none asked for
    logical :: is_return_study = .false.   !! errors and cost of returns instead of those tests
    logical :: is_faces = .false.          !! the list of surfaces of an IGES file, which is `deck`
    logical :: is_batch = .false.          !! many runs: `deck` is their list or folder
    integer :: n_jobs = 1                  !! of --jobs: runs side by side
    integer :: only = 0                    !! of --only: the number of a run; 0: all
    logical :: is_summary = .false.        !! the table of the batch alone
    logical :: is_iges = .false.           !! now of `post`: other arguments are not read
    logical :: is_check = .false., is_quiet = .false.
    logical :: is_start = .false.          !! --start: with `is_check`, the result with one frame
    logical :: is_trial_run = .false.      !! --trial-run: with `is_check`, fewer elements
    logical :: is_awake = .false.          !! --no-skip: no point is skipped
    logical :: wants_help = .false., wants_version = .false., wants_keywords = .false.
    character(:), allocatable :: reason     !! why the command cannot be carried out; else empty
  end type command_t

contains

  !> Read the arguments of the program.
  subroutine read_command_line(command)
    type(command_t), intent(out) :: command
    call parse_arguments(program_arguments(), command)
  end subroutine read_command_line

  !> Take a list of arguments apart, as far as the first error.
  subroutine parse_arguments(arguments, command)
    type(string_t), intent(in) :: arguments(:)
    type(command_t), intent(out) :: command
    integer :: i

    command%deck = ""
    command%output = ""
    command%restart = ""
    command%reason = ""
    allocate (command%overrides(0), command%user_files(0))
    i = 0
    if (size(arguments) > 0) command%is_material = arguments(1)%value == "material"
    if (size(arguments) > 0) command%is_batch = arguments(1)%value == "batch"
    if (size(arguments) > 0) command%is_faces = arguments(1)%value == "faces"
    if (size(arguments) > 0) command%is_iges = arguments(1)%value == "iges"
    if (command%is_iges) return
    if (command%is_material .or. command%is_batch .or. command%is_faces) i = 1
    do while (i < size(arguments) .and. command%reason == "")
      i = i + 1
      call take_argument(arguments, command, i)
    end do
    if (command%reason == "" .and. command%is_trial_run .and. .not. command%is_check) &
      command%reason = "option --trial-run goes with --check"
    if (command%reason == "" .and. command%is_start .and. .not. command%is_check) &
      command%reason = "option --start goes with --check"
    if (command%reason == "" .and. command%deck == "" .and. .not. (command%wants_help &
        .or. command%wants_version .or. command%wants_keywords)) then
      command%reason = "no "//subject(command)//" given"
    end if
  end subroutine parse_arguments

  !> The text of --help.
  function usage_text() result(text)
    character(:), allocatable :: text
    character(1), parameter :: feed = new_line("a")

    text = "usage: igaform DECK [options]"//feed &
           //"       igaform material DECK [options]   tests of one material point"//feed &
           //"       igaform batch LIST [--jobs N]     runs of a list or folder"//feed &
           //"       igaform faces FILE.igs            surfaces of an IGES file"//feed &
           //"  --out NAME         result file NAME.h5 (default: name of the deck, here)"//feed &
           //"  --threads N        OpenMP threads"//feed &
           //"  --user FILE        UMAT or VUMAT of *USER MATERIAL: .f .for .ftn .f77"//feed &
           //"                     .fpp .f90 .f95 .f03 .f08 (also in capitals), .c .cc"//feed &
           //"                     .cpp .cxx, .o .a or .so; may come several times"//feed &
           //"  --set NAME=VALUE   replace the value of a *PARAMETER of the deck"//feed &
           //"  --restart FILE     continue from a checkpoint NAME.ckpt.h5 of this deck"//feed &
           //"  --restart-any-build  also if another build of igaform wrote it"//feed &
           //"  --wall MINUTES     save the state and stop after so long"//feed &
           //"  --rebalance N      igaform-mpi: share the work again every N increments"//feed &
           //"                     where it is uneven (default: after 64, 128, 256 ...)"//feed &
           //"  --check            read, report counts, mass, step and cost; do not run"//feed &
           //"  --trial-run        with --check: a quick run with fewer elements, and what"//feed &
           //"                     mass scaling its energies allow"//feed &
           //"  --start            with --check: write the result with the frame of the"//feed &
           //"                     start, also of a set-up with errors"//feed &
           //"  --modes N          print the N lowest frequencies of the blank; do not run"//feed &
           //"  --return-study     igaform material: errors and cost of the return"//feed &
           //"                     mapping of each *PLASTIC; no tests"//feed &
           //"  --jobs N           igaform batch: runs side by side (default: 1);"//feed &
           //"                     --threads and --wall then count for each run whose"//feed &
           //"                     line has none; other options go in the lines"//feed &
           //"  --only N           igaform batch: run number N alone"//feed &
           //"  --summary          igaform batch: the table alone, no runs"//feed &
           //"  --no-skip          skip no inactive point, to measure what skipping"//feed &
           //"                     saves"//feed &
           //"  --quiet            errors and warnings only"//feed &
           //"  --keywords         print the reference of all keywords"//feed &
           //"  --version          print version, commit, sources and compiler"//feed &
           //"  --help, -h         print this text"//feed &
           //"exit codes: 0 done, 1 the input is invalid, 2 the run failed,"//feed &
           //"            3 interrupted, 4 the files could not be written"
  end function usage_text

  !> The text of --version: program and commit, digest of the sources, compiler, one a line.
  function version_text() result(text)
    character(:), allocatable :: text
    character(1), parameter :: feed = new_line("a")

    text = "igaform "//version//" ("//git_commit//")"//feed &
           //"sources    "//source_digest//feed &
           //"compiler   "//compiler_version()
  end function version_text

  !> Argument number i; takes its value too where it has one.
  subroutine take_argument(arguments, command, i)
    type(string_t), intent(in) :: arguments(:)
    type(command_t), intent(inout) :: command
    integer, intent(inout) :: i
    character(:), allocatable :: word, value

    word = arguments(i)%value
    if (command%is_batch) command%reason = error_in_batch(word)
    if (command%is_faces .and. index(word, "-") == 1 .and. all(word /= ["--help", "-h    "])) &
      command%reason = "option "//word//" does not go with 'igaform faces', which has none"
    if (command%reason /= "") return
    select case (word)
    case ("--check")
      command%is_check = .true.
    case ("--start")
      command%is_start = .true.
    case ("--trial-run", "--probe")   ! the second is the older name
      command%is_trial_run = .true.
    case ("--no-skip", "--awake")
      command%is_awake = .true.
    case ("--restart-any-build")
      command%is_any_build = .true.
    case ("--return-study")
      command%is_return_study = .true.
      if (.not. command%is_material) command%reason = "option --return-study goes with "// &
                                                     "'igaform material'"
    case ("--summary")
      command%is_summary = .true.
      if (.not. command%is_batch) command%reason = "option --summary goes with 'igaform batch'"
    case ("--quiet")
      command%is_quiet = .true.
    case ("--help", "-h")
      command%wants_help = .true.
    case ("--version")
      command%wants_version = .true.
    case ("--keywords")
      command%wants_keywords = .true.
    case ("--out", "--threads", "--set", "--user", "--modes", "--jobs", "--only", &
          "--restart", "--wall", "--rebalance")
      if (i == size(arguments)) then
        command%reason = "option "//word//" needs a value"
        return
      end if
      i = i + 1
      value = arguments(i)%value
      call take_value(word, value, command)
    case default
      if (index(word, "-") == 1) then
        command%reason = unknown_option(word, all_options())
      else if (command%deck /= "") then
        command%reason = "one "//subject(command)//" at a time: '"//command%deck//"' and '"// &
                         word//"' given"
      else
        command%deck = word
      end if
    end select
  end subroutine take_argument

  !> What a command is about.
  pure function subject(command) result(word)
    type(command_t), intent(in) :: command
    character(4) :: word

    word = merge("file", "deck", command%is_faces)
  end function subject

  !> Why an option of a run cannot be one of a whole batch, and what to do instead; else empty.
  pure function error_in_batch(word) result(reason)
    character(*), intent(in) :: word
    character(:), allocatable :: reason

    select case (word)
    case ("--out", "--set", "--user", "--no-skip", "--awake", "--restart-any-build", "--rebalance")
      reason = "give it in the lines of the list, after the decks"
    case ("--restart")
      reason = "a batch continues from its checkpoints by itself; for another one give it in "// &
              "the line of the run"
    case ("--check", "--start", "--trial-run", "--probe", "--modes")
      reason = "ask for it deck by deck, 'igaform DECK "//word//" ...'"
    case default
      reason = ""
      return
    end select
    reason = "option "//word//" does not go with 'igaform batch': "//reason
  end function error_in_batch

  !> An option that has a value.
  subroutine take_value(word, value, command)
    character(*), intent(in) :: word, value
    type(command_t), intent(inout) :: command
    logical :: is_number

    select case (word)
    case ("--out")
      command%output = with_ending(value)
    case ("--set")
      call append_text(command%overrides, value)
    case ("--user")
      call append_text(command%user_files, value)
    case ("--restart")
      command%restart = value
    case ("--wall")
      call read_real(value, command%wall_minutes, is_number)
      if (.not. is_number .or. .not. command%wall_minutes > 0.0_wp) command%reason = &
        "option --wall needs minutes above 0, not '"//value//"'"
    case ("--threads")
      call take_count(word, value, command%n_threads, command%reason)
    case ("--rebalance")
      call take_count(word, value, command%n_to_rebalance, command%reason)
    case ("--modes")
      call take_count(word, value, command%n_modes, command%reason)
    case ("--jobs")
      call take_count(word, value, command%n_jobs, command%reason)
    case ("--only")
      call take_count(word, value, command%only, command%reason)
    end select
    if (.not. command%is_batch .and. (word == "--jobs" .or. word == "--only")) then
      command%reason = "option "//word//" goes with 'igaform batch'"
    end if
  end subroutine take_value

  !> The path with `.h5` at its end, which viewers know a result by and restarts find it by. All
  !! other points belong to the name, as in `mu0.05`. A folder stays one, to be refused.
  pure function with_ending(path) result(file)
    character(*), intent(in) :: path
    character(:), allocatable :: file
    character(*), parameter :: ending = ".h5"

    file = path
    if (path == "") return
    if (path(len(path):) == "/" .or. path(max(1, len(path) - len(ending) + 1):) == ending) return
    file = path//ending
  end function with_ending

  !> All options.
  function all_options() result(options)
    type(string_t), allocatable :: options(:)

    options = strings([character(19) :: "--out", "--threads", "--set", "--user", "--check", &
                       "--restart", "--restart-any-build", "--wall", "--rebalance", &
                       "--modes", "--start", "--trial-run", "--no-skip", "--return-study", &
                       "--jobs", "--only", "--summary", "--quiet", "--keywords", &
                       "--version", "--help"])
  end function all_options

end module command_line
