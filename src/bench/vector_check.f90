!> Are the hot loops of this very program vectorised? Its machine code is listed with objdump, and
!! the arithmetic on doubles in the hot procedures is counted, packed in wide registers or not.
module vector_check
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: strings, to_text
  use child_process, only: run_program, program_missing
  use text_file, only: read_whole_file
  use system_files, only: make_folder, remove_file, program_folder
  use bench_paths, only: scratch_folder
  implicit none
  private

  public :: vector_count_t, count_vectors, count_listing, vector_line, is_vectorised

  !> Share of the arithmetic that must be wide. Loops over rows of any length have a scalar end
  !! beside the wide body, so that less than all of their code is wide.
  real(wp), parameter :: least_share = 0.8_wp, least_share_of_rows = 0.15_wp
  integer, parameter :: fewest = 10   !! operations of a procedure worth counting

  !> Instructions of arithmetic on doubles in one procedure.
  type :: vector_count_t
    character(:), allocatable :: procedure
    integer :: n_wide = 0       !! on registers of 256 or 512 bits
    integer :: n_other = 0      !! on fewer
    integer :: n_fused = 0      !! of the wide ones, multiply-adds
  end type vector_count_t

contains

  !> Count in the kernels, the kinematics, the Voce law and the closest points. Not allocated: there
  !! is no objdump.
  subroutine count_vectors(counts, error)
    type(vector_count_t), allocatable, intent(out) :: counts(:)
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: listing, path
    integer :: code
    logical :: is_there

    call make_folder(scratch_folder)
    path = scratch_folder//"/code.txt"
    call run_program(strings([character(4096) :: "objdump", "-d", "--no-show-raw-insn", &
                              program_folder()//"/igaform_bench"]), path, code)
    if (code == program_missing .or. code == 127) return
    call read_whole_file(path, listing, is_there)
    call remove_file(path)
    if (code /= 0 .or. .not. is_there) then
      call fail(error, "objdump failed with code "//to_text(code))
      return
    end if
    call count_listing(listing, counts)
    if (size(counts) < 2) call fail(error, "the hot procedures are not found in the program")
  end subroutine count_vectors

  !> Count the hot procedures of a listing, in its order.
  pure subroutine count_listing(listing, counts)
    character(*), intent(in) :: listing
    type(vector_count_t), allocatable, intent(out) :: counts(:)
    type(vector_count_t) :: current
    integer :: first, length
    logical :: is_inside

    allocate (counts(0))
    is_inside = .false.
    first = 1
    do while (first <= len(listing))
      length = index(listing(first:), new_line("a")) - 1
      if (length < 0) length = len(listing) - first + 1
      associate (line => listing(first:first + length - 1))
        if (is_inside .and. length == 0) then
          is_inside = .false.
          if (current%n_wide + current%n_other >= fewest) counts = [counts, current]
        else if (is_inside) then
          call count_line(line, current)
        else if (is_hot(line)) then
          is_inside = .true.
          current%procedure = line(index(line, "<") + 1:index(line, ">:") - 1)
          current%n_wide = 0
          current%n_other = 0
          current%n_fused = 0
        end if
      end associate
      first = first + length + 1
    end do
  end subroutine count_listing

  !> Is it the label of a hot procedure?
  pure logical function is_hot(line)
    character(*), intent(in) :: line
    character(40), parameter :: stems(16) = [character(40) :: "__ig_solid_p", "__plane_strain_p", &
      "__tensor_rotation_MOD_rotate_by_spin", "__tensor_rotation_MOD_turn_to_end", &
      "__voce_MOD_elastic_trial", "__voce_MOD_radial_return", &
      "__row_functions_MOD_exp", "__row_functions_MOD_log", "__power_sums_MOD_", &
      "__argument_products_MOD_", &
      "__invariant_yield_MOD_evaluate", "__yield_return_MOD_", "__hill_return_MOD_", &
      "__closest_point_MOD_follow_lanes", "__plane_yield_MOD_quick", &
      "__plane_yield_return_MOD_return"]
    integer :: i

    is_hot = .false.
    ! What gathers is no arithmetic.
    if (index(line, ">:") == 0 .or. index(line, "_MOD_gather") > 0) return
    do i = 1, size(stems)
      is_hot = is_hot .or. index(line, "<"//trim(stems(i))) > 0
    end do
  end function is_hot

  !> One line of the listing: address, tab, mnemonic, operands.
  pure subroutine count_line(line, counts)
    character(*), intent(in) :: line
    type(vector_count_t), intent(inout) :: counts
    logical :: is_arithmetic, is_fused, is_packed
    character(16) :: word
    integer :: at

    at = index(line, achar(9), back=.true.)
    if (at == 0) return
    word = line(at + 1:min(len(line), at + 16))
    word = word(:max(1, scan(word//" ", " ") - 1))
    is_fused = index(word, "vfm") == 1 .or. index(word, "vfnm") == 1
    is_arithmetic = is_fused .or. any(word(:5) == ["vaddp", "vadds", "vsubp", "vsubs", "vmulp", &
                                                   "vmuls", "vdivp", "vdivs"])
    is_packed = index(word, "pd") > 0
    if (.not. is_arithmetic .or. (.not. is_packed .and. index(word, "sd") == 0)) return
    if (is_packed .and. (index(line, "%ymm") > 0 .or. index(line, "%zmm") > 0)) then
      counts%n_wide = counts%n_wide + 1
      if (is_fused) counts%n_fused = counts%n_fused + 1
    else
      counts%n_other = counts%n_other + 1
    end if
  end subroutine count_line

  !> Is nearly all of the arithmetic wide, with multiply-adds among it?
  pure logical function is_vectorised(counts)
    type(vector_count_t), intent(in) :: counts
    character(20), parameter :: of_rows(3) = [character(20) :: "__voce_MOD_", &
      "__tensor_rotation_", "__row_functions_"]
    real(wp) :: least
    integer :: i

    least = least_share
    do i = 1, size(of_rows)
      if (index(counts%procedure, trim(of_rows(i))) == 1) least = least_share_of_rows
    end do
    is_vectorised = counts%n_fused > 0 .and. &
                    counts%n_wide >= least*(counts%n_wide + counts%n_other)
  end function is_vectorised

  !> The counts of a procedure in one line.
  pure function vector_line(counts) result(line)
    type(vector_count_t), intent(in) :: counts
    character(:), allocatable :: line
    character(120) :: buffer

    write (buffer, "(a50, i8, i8, i8, 2x, a)") counts%procedure//repeat(" ", 50), counts%n_wide, &
      counts%n_fused, counts%n_other, trim(merge("vectorised", "SCALAR    ", is_vectorised(counts)))
    line = trim(buffer)
  end function vector_line

end module vector_check
