!> Factors L D L' of a symmetric sparse matrix, by MUMPS, on one thread: equal matrices give equal
!! bits. One analysis serves all matrices with the same entries. Factors that do not fit in memory
!! are kept on disk. Of several processes with equal matrices the first one finds the factors and
!! solves for all.
module sparse_factor
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_funptr, c_int, c_int64_t, c_loc, &
                                         c_null_funptr, c_null_ptr
  use child_process, only: c_text
  use kinds, only: wp
  use failure, only: error_t, fail
  use free_memory, only: free_megabytes
  use text, only: rounded_text, to_text
  use mumps_library, only: find_mumps, call_mumps, mumps_call_t, mumps_analyse, mumps_factorise, &
                           mumps_solve, mumps_end
  use ranks, only: ranks_t, is_first, share_error
  use sparse_matrix, only: symmetric_matrix_t
  implicit none
  private

  !> Factors of one matrix at a time. Never to be copied: the memory is that of MUMPS.
  type, public :: sparse_factor_t
    private
    type(c_funptr) :: entry = c_null_funptr
    type(mumps_call_t) :: call
    character(:), allocatable, public :: folder    !! of factors on disk; not allocated: in memory
    logical, public :: has_buffer = .false.    !! BLAS has its buffer, which it keeps: the program
                                               !! has found factors before, these or others
    logical, public :: is_short = .false.      !! what failed was memory or disk, not the matrix
    integer, public :: n_negative = 0          !! pivots of the last factors
    integer, public :: null_unknown = 0        !! the first with a pivot of zero, 0: there is none
    integer, public :: megabytes = 0           !! of memory: as estimated, then as used
    real(wp), public :: n_entries = 0.0_wp     !! of the factors, as estimated
    real(wp), public :: n_operations = 0.0_wp  !! on numbers for one set of factors, as estimated
    class(ranks_t), allocatable :: ranks       ! processes with equal matrices; absent: one
  contains
    procedure, public :: analyse, factorise, solve, clear, take_ranks
    final :: end_factor
  end type sparse_factor_t

  ! INFOG(1) of MUMPS.
  integer(c_int), parameter :: no_integers = -7_c_int, short_of_integers = -8_c_int, &
                               short_of_reals = -9_c_int, is_singular = -10_c_int, &
                               short_in_solution = -11_c_int, no_memory = -13_c_int, &
                               short_of_room = -14_c_int, no_disk = -90_c_int

  ! Percent of memory beyond the estimate, where the one before was not enough.
  integer(c_int), parameter :: spare(5) = [20_c_int, 50_c_int, 100_c_int, 300_c_int, 1000_c_int]

contains

  !> Let the first of these processes work for all.
  subroutine take_ranks(self, ranks)
    class(sparse_factor_t), intent(inout) :: self
    class(ranks_t), intent(in), optional :: ranks      !! absent: there is but one

    if (present(ranks) .and. .not. allocated(self%ranks)) allocate (self%ranks, source=ranks)
  end subroutine take_ranks

  !> Find the order of elimination for all matrices with these entries, and what the factors need.
  subroutine analyse(self, matrix, error, folder)
    class(sparse_factor_t), intent(inout) :: self
    type(symmetric_matrix_t), intent(in) :: matrix
    type(error_t), allocatable, intent(out) :: error
    character(*), intent(in), optional :: folder   !! where factors are kept instead of in memory

    call self%clear()
    if (is_first(self%ranks)) call analyse_here(self, matrix, error, folder)
    call share_outcome(self, error)
  end subroutine analyse

  !> What the first process has found.
  subroutine share_outcome(self, error)
    type(sparse_factor_t), intent(inout) :: self
    type(error_t), allocatable, intent(inout) :: error
    real(wp) :: facts(7)

    if (.not. allocated(self%ranks)) return
    facts = [real(self%n_negative, wp), real(self%null_unknown, wp), real(self%megabytes, wp), &
             self%n_entries, self%n_operations, merge(1.0_wp, 0.0_wp, [self%is_short, &
                                                                       self%has_buffer])]
    call self%ranks%share(facts, 0)
    self%n_negative = nint(facts(1))
    self%null_unknown = nint(facts(2))
    self%megabytes = nint(facts(3))
    self%n_entries = facts(4)
    self%n_operations = facts(5)
    self%is_short = facts(6) > 0.5_wp
    self%has_buffer = facts(7) > 0.5_wp
    call share_error(self%ranks, error)
  end subroutine share_outcome

  subroutine analyse_here(self, matrix, error, folder)
    type(sparse_factor_t), intent(inout) :: self
    type(symmetric_matrix_t), intent(in) :: matrix
    type(error_t), allocatable, intent(out) :: error
    character(*), intent(in), optional :: folder

    call find_mumps(self%entry, error)
    if (allocated(error)) return
    self%call%n = int(matrix%n, c_int)
    self%call%spare = spare(1)
    call run(self, mumps_analyse, matrix, error)
    if (allocated(error)) return
    call choose_place(self, folder, error)
    self%n_entries = self%call%n_factor_entries
    self%n_operations = self%call%n_operations
  end subroutine analyse_here

  !> In memory where there is enough of it, else on disk. Fails where there is not enough for that:
  !! OpenBLAS asks for its buffer again and again where the system refuses it. It does so with the
  !! first factors of a process.
  subroutine choose_place(self, folder, error)
    type(sparse_factor_t), intent(inout) :: self
    character(*), intent(in), optional :: folder
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: buffer = 128.0_wp   ! [MB]
    real(wp) :: free, of_blas
    character(:), allocatable :: beside

    of_blas = merge(0.0_wp, buffer, self%has_buffer)
    free = free_megabytes() - of_blas
    self%megabytes = int(self%call%megabytes)
    if (present(folder)) then
      self%folder = folder
    else if (with_spare(self%megabytes) > free) then
      self%folder = disk_folder()
    end if
    if (.not. allocated(self%folder)) return
    self%megabytes = int(self%call%megabytes_on_disk)
    self%is_short = with_spare(self%megabytes) > free
    if (.not. self%is_short) return
    beside = ""
    if (of_blas > 0.0_wp) beside = ", beside "//rounded_text(of_blas)//" MB for BLAS"
    call fail(error, "too little memory for the factors of "//to_text(int(self%call%n))// &
              " equations: they need "//to_text(int(self%call%megabytes))//" MB, or "// &
              to_text(self%megabytes)//" MB with factors on disk"//beside//", and "// &
              rounded_text(free + of_blas)//" MB are free")
  end subroutine choose_place

  !> What MUMPS asks for at first [MB].
  pure real(wp) function with_spare(estimate) result(megabytes)
    integer, intent(in) :: estimate

    megabytes = estimate*(1.0_wp + 0.01_wp*spare(1))
  end function with_spare

  !> Where large temporary files go: TMPDIR, or the folder of the system that lies on a disk.
  function disk_folder() result(folder)
    character(:), allocatable :: folder
    integer :: length, status

    call get_environment_variable("TMPDIR", length=length, status=status)
    if (status /= 0 .or. length == 0) then
      folder = "/var/tmp"
    else
      allocate (character(length) :: folder)
      call get_environment_variable("TMPDIR", value=folder)
    end if
  end function disk_folder

  !> Factors of a matrix with the entries analysed; on disk where the system has refused the memory.
  !! Fails where it is singular, by `null_unknown`, and where memory does not do; then there are no
  !! factors.
  subroutine factorise(self, matrix, error)
    class(sparse_factor_t), intent(inout) :: self
    type(symmetric_matrix_t), intent(in) :: matrix
    type(error_t), allocatable, intent(out) :: error

    if (is_first(self%ranks)) call factorise_here(self, matrix, error)
    call share_outcome(self, error)
  end subroutine factorise

  subroutine factorise_here(self, matrix, error)
    type(sparse_factor_t), intent(inout) :: self
    type(symmetric_matrix_t), intent(in) :: matrix
    type(error_t), allocatable, intent(out) :: error
    integer :: i

    do i = 1, size(spare)
      self%call%spare = spare(i)
      call run(self, mumps_factorise, matrix, error)
      if (self%call%code == no_memory .and. .not. allocated(self%folder)) then
        self%folder = disk_folder()
        call run(self, mumps_factorise, matrix, error)
      end if
      if (self%call%code /= short_of_integers .and. self%call%code /= short_of_reals) exit
    end do
    self%n_negative = int(self%call%n_negative)
    self%null_unknown = int(self%call%null_unknown)
    if (allocated(error)) return
    self%has_buffer = .true.
    self%megabytes = int(self%call%megabytes)
    if (self%call%n_null > 0) &
      call fail(error, "the matrix of "//to_text(matrix%n)//" equations is singular: "// &
                to_text(int(self%call%n_null))//" of its pivots are zero, the first that of "// &
                "unknown "//to_text(self%null_unknown))
  end subroutine factorise_here

  !> Solve for right sides in columns, which become the solutions.
  subroutine solve(self, right, error)
    class(sparse_factor_t), intent(inout) :: self
    real(wp), intent(inout), contiguous, target :: right(:, :)
    type(error_t), allocatable, intent(out) :: error

    if (is_first(self%ranks)) then
      self%call%right = c_loc(right)
      self%call%n_right = int(size(right, 2), c_int)
      call call_mumps(self%entry, mumps_solve, self%call)
      self%call%right = c_null_ptr
      call report(self, error)
    end if
    if (.not. allocated(self%ranks)) return
    call share_columns(self%ranks, size(right), right)
    call share_outcome(self, error)
  end subroutine solve

  !> Solutions of the first process.
  subroutine share_columns(ranks, n, values)
    class(ranks_t), intent(in) :: ranks
    integer, intent(in) :: n
    real(wp), intent(inout) :: values(n)

    call ranks%share(values, 0)
  end subroutine share_columns

  !> Give everything back. What BLAS keeps it keeps.
  subroutine clear(self)
    class(sparse_factor_t), intent(inout) :: self
    type(mumps_call_t) :: fresh

    if (c_associated(self%call%instance)) call call_mumps(self%entry, mumps_end, self%call)
    self%call = fresh
    if (allocated(self%folder)) deallocate (self%folder)
    self%is_short = .false.
    self%n_negative = 0
    self%null_unknown = 0
    self%megabytes = 0
    self%n_entries = 0.0_wp
    self%n_operations = 0.0_wp
  end subroutine clear

  subroutine end_factor(self)
    type(sparse_factor_t), intent(inout) :: self

    call self%clear()
  end subroutine end_factor

  !> Have MUMPS do a job on the matrix.
  subroutine run(self, job, matrix, error)
    type(sparse_factor_t), intent(inout) :: self
    integer(c_int), intent(in) :: job
    type(symmetric_matrix_t), intent(in), target :: matrix
    type(error_t), allocatable, intent(out) :: error
    character(kind=c_char), allocatable, target :: path(:)

    if (allocated(self%folder)) then
      path = c_text(self%folder)
      self%call%folder = c_loc(path)
    end if
    self%call%n_entries = size(matrix%values, kind=c_int64_t)
    self%call%rows = c_loc(matrix%rows)
    self%call%columns = c_loc(matrix%columns)
    self%call%values = c_loc(matrix%values)
    call call_mumps(self%entry, job, self%call)
    self%call%rows = c_null_ptr
    self%call%columns = c_null_ptr
    self%call%values = c_null_ptr
    self%call%folder = c_null_ptr
    call report(self, error)
  end subroutine run

  !> What went wrong, in words.
  subroutine report(self, error)
    type(sparse_factor_t), intent(inout) :: self
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: equations, estimate

    associate (code => self%call%code)
      self%is_short = any(code == [no_integers, no_memory, no_disk])
      if (code >= 0) return
      equations = to_text(int(self%call%n))//" equations"
      estimate = ""
      if (self%megabytes > 0) estimate = ", about "//to_text(self%megabytes)//" MB of "// &
        rounded_text(min(free_megabytes(), 1.0e9_wp))//" that are free"
      select case (code)
      case (is_singular)
        call fail(error, "the matrix of "//equations//" is singular: after "// &
                  to_text(int(self%call%detail))//" pivots there is none left")
      case (no_integers, no_memory)
        call fail(error, "the system refuses the memory for the factors of "//equations// &
                  estimate)
      case (short_of_integers, short_of_reals, short_in_solution, short_of_room)
        call fail(error, "the factors of "//equations//" need more than "// &
                  to_text(int(spare(size(spare))))//" % beyond the memory estimated"// &
                  estimate//": so many pivots are exchanged")
      case (no_disk)
        call fail(error, "the factors of "//equations//", which do not fit in memory"// &
                  estimate//", cannot be written to the folder "//self%folder// &
                  ": see TMPDIR")
      case default
        call fail(error, "MUMPS cannot solve "//equations//": its code is "// &
                  to_text(int(code))//", "//to_text(int(self%call%detail)))
      end select
    end associate
  end subroutine report

end module sparse_factor
