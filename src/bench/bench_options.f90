!> The command line of the benchmark.
module bench_options
  use text, only: string_t, strings
  use command_options, only: take_count, unknown_option
  implicit none
  private

  public :: options_t, parse_options, usage_text, is_chosen

  !> What the user asked for.
  type :: options_t
    type(string_t), allocatable :: only(:)   !! parts of names, none: all
    character(:), allocatable :: json        !! file to write, or empty
    integer :: n_threads = 0                 !! most threads, 0: as many as OpenMP gives
    integer :: n_rounds = 1                  !! times that all is measured; the least counts
    logical :: is_quick = .false., wants_list = .false., wants_help = .false.
    logical :: wants_vectors = .false.
    logical :: is_judging = .false.          !! asked for what `python -m post bench` does
    character(:), allocatable :: reason       !! why the command cannot be carried out; else empty
  end type options_t

contains

  !> Take a list of arguments apart, as far as the first error.
  subroutine parse_options(arguments, options)
    type(string_t), intent(in) :: arguments(:)
    type(options_t), intent(out) :: options
    integer :: i

    allocate (options%only(0))
    options%json = ""
    options%reason = ""
    i = 0
    do while (i < size(arguments) .and. options%reason == "")
      i = i + 1
      select case (arguments(i)%value)
      case ("--quick")
        options%is_quick = .true.
      case ("--list")
        options%wants_list = .true.
      case ("--vectors")
        options%wants_vectors = .true.
      case ("--targets", "--compare")
        options%is_judging = .true.
        options%reason = arguments(i)%value//" is an option of python -m post bench FILE, "// &
                        "which judges what --json FILE has stored"
      case ("--help", "-h")
        options%wants_help = .true.
      case ("--only", "--json", "--threads", "--rounds")
        if (i == size(arguments)) then
          options%reason = "option "//arguments(i)%value//" needs a value"
          return
        end if
        i = i + 1
        associate (option => arguments(i - 1)%value, value => arguments(i)%value)
          select case (option)
          case ("--only")
            options%only = [options%only, arguments(i)]
          case ("--json")
            options%json = value
          case ("--threads")
            call take_count(option, value, options%n_threads, options%reason)
          case ("--rounds")
            call take_count(option, value, options%n_rounds, options%reason)
          end select
        end associate
      case default
        options%reason = unknown_option(arguments(i)%value, strings([character(9) :: "--quick", &
          "--list", "--vectors", "--help", "--only", "--json", "--threads", "--rounds", &
          "--targets", "--compare"]))
      end select
    end do
  end subroutine parse_options

  !> Does the name hold one of the texts of --only, if there are any?
  pure logical function is_chosen(options, name)
    type(options_t), intent(in) :: options
    character(*), intent(in) :: name
    integer :: i

    is_chosen = size(options%only) == 0
    do i = 1, size(options%only)
      is_chosen = is_chosen .or. index(name, options%only(i)%value) > 0
    end do
  end function is_chosen

  !> The text of --help.
  function usage_text() result(text)
    character(:), allocatable :: text
    character(1), parameter :: feed = new_line("a")

    text = "usage: igaform_bench [options]"//feed &
           //"  --quick            shorter samples, no long cases"//feed &
           //"  --only TEXT        names that hold this text; may come several times"//feed &
           //"  --rounds N         measure all N times, the least counts (1)"//feed &
           //"  --threads N        measure 1 to N threads (default: all cores)"//feed &
           //"  --json FILE        store the records, for python -m post bench FILE"//feed &
           //"  --list             names of all records"//feed &
           //"  --vectors          are the hot loops vectorised? (needs objdump)"//feed &
           //"  --help"//feed &
           //"exit codes: 0 done, 1 the command is invalid, 2 a measurement failed, 77 no objdump"
  end function usage_text

end module bench_options
