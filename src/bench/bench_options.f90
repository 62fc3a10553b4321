!> The command line of the benchmark.
module bench_options
  use text, only: string_t, strings, nearest_name, read_integer
  implicit none
  private

  public :: options_t, read_options, parse_options, usage_text, is_chosen

  integer, parameter :: rounds_of_targets = 3   !! a host may be slow for the time of one

  !> What the user asked for.
  type :: options_t
    type(string_t), allocatable :: only(:)   !! parts of names, none: all
    type(string_t), allocatable :: targets(:) !! the same of what has a target; none: all
    character(:), allocatable :: json        !! file to write, or empty
    character(:), allocatable :: compare     !! file to compare with, or empty
    integer :: n_threads = 0                 !! most threads, 0: as many as OpenMP gives
    integer :: n_rounds = 0                  !! times that all is measured; the least counts
    logical :: is_quick = .false., wants_list = .false., wants_help = .false.
    logical :: wants_vectors = .false.
    character(:), allocatable :: fault       !! why the command cannot be carried out; else empty
  end type options_t

contains

  !> Read the arguments of the program.
  subroutine read_options(options)
    type(options_t), intent(out) :: options
    type(string_t), allocatable :: arguments(:)
    integer :: i, length

    allocate (arguments(command_argument_count()))
    do i = 1, size(arguments)
      call get_command_argument(i, length=length)
      allocate (character(length) :: arguments(i)%value)
      call get_command_argument(i, value=arguments(i)%value)
    end do
    call parse_options(arguments, options)
  end subroutine read_options

  !> Take a list of arguments apart, as far as the first fault.
  subroutine parse_options(arguments, options)
    type(string_t), intent(in) :: arguments(:)
    type(options_t), intent(out) :: options
    integer :: i, least_rounds

    least_rounds = 1
    allocate (options%only(0), options%targets(0))
    options%json = ""
    options%compare = ""
    options%fault = ""
    i = 0
    do while (i < size(arguments) .and. options%fault == "")
      i = i + 1
      select case (arguments(i)%value)
      case ("--quick")
        options%is_quick = .true.
      case ("--list")
        options%wants_list = .true.
      case ("--vectors")
        options%wants_vectors = .true.
      case ("--targets")
        options%targets = with_targets()
        least_rounds = rounds_of_targets
      case ("--help", "-h")
        options%wants_help = .true.
      case ("--only", "--json", "--compare", "--threads", "--rounds")
        call take_value(arguments, options, i)
      case default
        options%fault = unknown(arguments(i)%value)
      end select
    end do
    if (options%n_rounds == 0) options%n_rounds = least_rounds
  end subroutine parse_options

  subroutine take_value(arguments, options, i)
    type(string_t), intent(in) :: arguments(:)
    type(options_t), intent(inout) :: options
    integer, intent(inout) :: i
    logical :: is_number

    if (i == size(arguments)) then
      options%fault = "option "//arguments(i)%value//" needs a value"
      return
    end if
    i = i + 1
    associate (value => arguments(i)%value)
      select case (arguments(i - 1)%value)
      case ("--only")
        options%only = [options%only, arguments(i)]
      case ("--json")
        options%json = value
      case ("--compare")
        options%compare = value
      case ("--threads")
        call take_number(options%n_threads)
      case ("--rounds")
        call take_number(options%n_rounds)
      end select
    end associate

  contains

    subroutine take_number(number)
      integer, intent(inout) :: number

      call read_integer(arguments(i)%value, number, is_number)
      if (.not. is_number .or. number < 1) &
        options%fault = "option "//arguments(i - 1)%value// &
                        " needs a whole number of at least 1, not '"//arguments(i)%value//"'"
    end subroutine take_number
  end subroutine take_value

  function unknown(word) result(fault)
    character(*), intent(in) :: word
    character(:), allocatable :: fault, nearest

    nearest = nearest_name(word, strings([character(9) :: "--quick", "--list", "--vectors", &
                                          "--help", "--only", "--json", "--compare", "--threads", &
                                          "--targets", "--rounds"]))
    fault = "unknown option '"//word//"'"
    if (nearest /= "") fault = fault//"; nearest is "//nearest
  end function unknown

  !> Parts of the names of all records that have a target.
  function with_targets() result(names)
    type(string_t), allocatable :: names(:)

    names = strings([character(36) :: "force/p2/3x3x3/voce/plain/default", &
                     "force/p2/2x2x3/voce/plain/default", "force/p2/2x2x2/voce/plain/default", &
                     "force/p2/3x3x3/voce/rational", "force/p2/2x2x3/voce/rational", &
                     "force/p2/2x2x2/voce/rational", "force/p2/3x3x4/voce", &
                     "force/p1/1x1x2/voce/plain", "force/p1/2x2x2/voce/plain/default", &
                     "force/p2/2x3x2/voce", "force/p3/3x3x3/voce", "force/p3/4x4x4/voce", &
                     "force/p4/4x4x4/voce", "force/p5/5x5x5/voce", "smooth", &
                     "elements/8000", "/faces/", "/refined/", "step/channel"])
  end function with_targets

  !> Does the name hold one of the texts of --only, and has it a target if --targets is there?
  pure logical function is_chosen(options, name)
    type(options_t), intent(in) :: options
    character(*), intent(in) :: name

    is_chosen = holds_one(name, options%only) .and. holds_one(name, options%targets)
  end function is_chosen

  !> Does the name hold one of the parts, if there are any?
  pure logical function holds_one(name, parts)
    character(*), intent(in) :: name
    type(string_t), intent(in) :: parts(:)
    integer :: i

    holds_one = size(parts) == 0
    do i = 1, size(parts)
      holds_one = holds_one .or. index(name, parts(i)%value) > 0
    end do
  end function holds_one

  !> The text of --help.
  function usage_text() result(text)
    character(:), allocatable :: text
    character(1), parameter :: feed = new_line("a")

    text = "usage: igaform_bench [options]"//feed &
           //"  --quick            shorter samples, no long cases"//feed &
           //"  --only TEXT        names that hold this text; may come several times"//feed &
           //"  --targets          only what has a target, with the table of targets behind"//feed &
           //"  --rounds N         measure all N times, the least counts (1; --targets: 3)"//feed &
           //"  --threads N        measure 1 to N threads (default: all cores)"//feed &
           //"  --json FILE        store the records"//feed &
           //"  --compare OLD.json ratios to the records of an earlier run"//feed &
           //"  --list             names of all records"//feed &
           //"  --vectors          are the hot loops vectorised? (needs objdump)"//feed &
           //"  --help"//feed &
           //"exit codes: 0 done, 1 the command is at fault, 2 a measurement failed, 77 no objdump"
  end function usage_text

end module bench_options
