!> Utility routines that subroutines of users call: about the run, locks for their data, the end of
!! the run and messages.
!!
!! Built into a shared library of its own, which the program and the compiled subroutines both
!! link. The routines have the names and arguments that Abaqus gives them; CMakeLists.txt gives some
!! a second name, with V before it, by which an explicit analysis calls them.
!!
!! The calls carry no argument that says where they come from, so this module remembers the name of
!! the job and keeps the locks.
module abaqus_utilities
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_size_t, c_double, c_ptr, &
                                         c_f_pointer
  use, intrinsic :: iso_fortran_env, only: error_unit
  use omp_lib, only: omp_lock_kind, omp_init_lock, omp_set_lock, omp_unset_lock, &
                     omp_get_thread_num, omp_get_max_threads
  use user_watch, only: end_run, values_on_offer
  implicit none
  private

  public :: set_job

  integer, parameter :: longest_line = 400   ! of a message
  integer, parameter :: n_locks = 100, longest = 255
  integer(omp_lock_kind) :: locks(n_locks)
  logical :: is_ready(n_locks) = .false.
  character(longest) :: job = "igaform", folder = "."

contains

  !> Name of the job and folder of its results, for subroutines that ask.
  subroutine set_job(name, name_length, place, place_length) bind(C, name="igaform_set_job")
    integer(c_int), value :: name_length, place_length
    character(kind=c_char), intent(in) :: name(name_length), place(place_length)

    job = text_of(name)
    folder = text_of(place)
  end subroutine set_job

  !> The folder of the results, without a slash at its end.
  subroutine getoutdir(outdir, length, outdir_length) bind(C, name="getoutdir_")
    integer(c_size_t), value :: outdir_length
    character(kind=c_char), intent(out) :: outdir(outdir_length)
    integer(c_int), intent(out) :: length

    call copy_text(folder, outdir, length)
  end subroutine getoutdir

  !> The name of the job: that of the result file without its ending.
  subroutine getjobname(name, length, name_length) bind(C, name="getjobname_")
    integer(c_size_t), value :: name_length
    character(kind=c_char), intent(out) :: name(name_length)
    integer(c_int), intent(out) :: length

    call copy_text(job, name, length)
  end subroutine getjobname

  subroutine copy_text(text, characters, length)
    character(*), intent(in) :: text
    character(kind=c_char), intent(out) :: characters(:)
    integer(c_int), intent(out) :: length
    integer :: i

    characters = " "
    length = min(len_trim(text), size(characters))
    do i = 1, length
      characters(i) = text(i:i)
    end do
  end subroutine copy_text

  !> There is one process, of rank 0.
  subroutine getrank(rank) bind(C, name="getrank_")
    integer(c_int), intent(out) :: rank

    rank = 0
  end subroutine getrank

  !> Number of processes, not of threads.
  subroutine getnumcpus(n) bind(C, name="getnumcpus_")
    integer(c_int), intent(out) :: n

    n = 1
  end subroutine getnumcpus

  !> Number of threads that may call the subroutine at once.
  integer(c_int) function getnumthreads() bind(C, name="getnumthreads_")
    getnumthreads = int(omp_get_max_threads(), c_int)
  end function getnumthreads

  !> Number of the calling thread, from 0.
  integer(c_int) function get_thread_id() bind(C, name="get_thread_id_")
    get_thread_id = int(omp_get_thread_num(), c_int)
  end function get_thread_id

  !> Make lock `id` (1 to 100) ready; others are left alone.
  subroutine mutexinit(id) bind(C, name="mutexinit_")
    integer(c_int), intent(in) :: id

    if (id < 1 .or. id > n_locks) return
    !$omp critical (igaform_locks)
    if (.not. is_ready(id)) call omp_init_lock(locks(id))
    is_ready(id) = .true.
    !$omp end critical (igaform_locks)
  end subroutine mutexinit

  !> Wait for a lock and take it. One that is not ready locks nothing.
  subroutine mutexlock(id) bind(C, name="mutexlock_")
    integer(c_int), intent(in) :: id

    if (id < 1 .or. id > n_locks) return
    if (is_ready(id)) call omp_set_lock(locks(id))
  end subroutine mutexlock

  !> Give a lock back.
  subroutine mutexunlock(id) bind(C, name="mutexunlock_")
    integer(c_int), intent(in) :: id

    if (id < 1 .or. id > n_locks) return
    if (is_ready(id)) call omp_unset_lock(locks(id))
  end subroutine mutexunlock

  !> Ends the run: the user's subroutine found no way on.
  subroutine xit() bind(C, name="xit_")
    call end_run("XIT")
  end subroutine xit

  !> The same from an explicit analysis.
  subroutine xplb_exit() bind(C, name="xplb_exit_")
    call end_run("XPLB_EXIT")
  end subroutine xplb_exit

  !> Stress (S) or state variables (SDV) of the point that a USDFLD or UVARM is called for. Results
  !! of other points and of other parts of a model are not available.
  subroutine getvrm(name, array, jarray, flags, code, jmac, jmatyp, matlayo, laccfla, name_length, &
                    flag_length) bind(C, name="getvrm_")
    integer(c_size_t), value :: name_length, flag_length
    character(kind=c_char), intent(in) :: name(name_length)
    real(c_double), intent(inout) :: array(*)
    integer(c_int), intent(inout) :: jarray(*)
    character(kind=c_char), intent(inout) :: flags(flag_length, *)
    integer(c_int), intent(out) :: code
    integer(c_int), intent(in) :: jmac(*), jmatyp(*), matlayo, laccfla   ! of no use here

    call copy_values("GETVRM", name_length, name, array, jarray, flag_length, flags)
    code = 0_c_int
  end subroutine getvrm

  !> The same for the points that a VUSDFLD is called for, all of them for each component.
  subroutine vgetvrm(name, array, jarray, flags, code, name_length, flag_length) &
      bind(C, name="vgetvrm_")
    integer(c_size_t), value :: name_length, flag_length
    character(kind=c_char), intent(in) :: name(name_length)
    real(c_double), intent(inout) :: array(*)
    integer(c_int), intent(inout) :: jarray(*)
    character(kind=c_char), intent(inout) :: flags(flag_length, *)
    integer(c_int), intent(out) :: code

    call copy_values("VGETVRM", name_length, name, array, jarray, flag_length, flags)
    code = 0_c_int
  end subroutine vgetvrm

  !> What was asked for, of the call in hand; anything else ends the run.
  subroutine copy_values(routine, name_length, name, array, jarray, flag_length, flags)
    character(*), intent(in) :: routine
    integer(c_size_t), intent(in) :: name_length, flag_length
    character(kind=c_char), intent(in) :: name(name_length)
    real(c_double), intent(inout) :: array(*)
    integer(c_int), intent(inout) :: jarray(*)
    character(kind=c_char), intent(inout) :: flags(flag_length, *)
    real(c_double), pointer :: values(:)
    type(c_ptr) :: place
    integer(c_int) :: n_points, n_states
    integer :: first, last

    call values_on_offer(place, n_points, n_states)
    if (n_points == 0) call refuse(routine, routine//" is called, which is not provided")
    call c_f_pointer(place, values, [n_points*(6 + n_states)])
    first = 1
    last = 6*n_points
    if (text_of(name) == "SDV" .or. text_of(name) == "sdv") then
      first = last + 1
      last = size(values)
    else if (text_of(name) /= "S" .and. text_of(name) /= "s") then
      call refuse(routine, routine//" is called for "//text_of(name)// &
                  ", which is not provided (S and SDV are)")
    end if
    array(:last - first + 1) = values(first:last)
    jarray(:last - first + 1) = 0_c_int
    flags(:, :last - first + 1) = " "
  end subroutine copy_values

  subroutine refuse(name, why)
    character(*), intent(in) :: name, why

    call write_line("error: "//why)
    call end_run(name)
  end subroutine refuse

  !> A message of the user's subroutine; LOP = -3 ends the run.
  subroutine stdb_abqerr(lop, text, intv, realv, charv, text_length, charv_length) &
      bind(C, name="stdb_abqerr_")
    integer(c_int), intent(in) :: lop, intv(*)
    real(c_double), intent(in) :: realv(*)
    integer(c_size_t), value :: text_length, charv_length
    character(kind=c_char), intent(in) :: text(text_length), charv(charv_length, *)

    call report("STDB_ABQERR", lop, text, intv, realv, charv_length, charv)
  end subroutine stdb_abqerr

  !> The same from an explicit analysis.
  subroutine xplb_abqerr(lop, text, intv, realv, charv, text_length, charv_length) &
      bind(C, name="xplb_abqerr_")
    integer(c_int), intent(in) :: lop, intv(*)
    real(c_double), intent(in) :: realv(*)
    integer(c_size_t), value :: text_length, charv_length
    character(kind=c_char), intent(in) :: text(text_length), charv(charv_length, *)

    call report("XPLB_ABQERR", lop, text, intv, realv, charv_length, charv)
  end subroutine xplb_abqerr

  !> Write a message of the user's subroutine; LOP = -3 ends the run.
  subroutine report(name, lop, text, intv, realv, charv_length, charv)
    character(*), intent(in) :: name   ! of the routine that was called
    integer(c_size_t), intent(in) :: charv_length
    integer(c_int), intent(in) :: lop, intv(*)
    real(c_double), intent(in) :: realv(*)
    character(kind=c_char), intent(in) :: text(:), charv(charv_length, *)
    character(longest_line) :: line

    call fill_in(text, intv, realv, charv_length, charv, line)
    call write_line("message of the user's subroutine: "//trim(line))
    if (lop == -3) call end_run(name//" with LOP = -3")
  end subroutine report

  !> Write a line to standard error at once: in a buffer it would be lost in a crash, and follow
  !! the words of `end_run`, which use no unit.
  subroutine write_line(text)
    character(*), intent(in) :: text

    write (error_unit, "(a)") "igaform: "//text
    flush (error_unit)
  end subroutine write_line

  !> A text with the next whole number for each %I, real number for %R and word for %S.
  subroutine fill_in(text, intv, realv, charv_length, charv, line)
    integer(c_size_t), intent(in) :: charv_length
    character(kind=c_char), intent(in) :: text(:), charv(charv_length, *)
    integer(c_int), intent(in) :: intv(*)
    real(c_double), intent(in) :: realv(*)
    character(*), intent(out) :: line
    character(24) :: value
    integer :: i, n, used(3)

    line = ""
    used = 0
    n = 0
    i = 1
    do while (i <= size(text))
      value = text(i)
      if (text(i) == "%" .and. i < size(text)) then
        i = i + 1
        select case (text(i))
        case ("I", "i")
          used(1) = used(1) + 1
          write (value, "(i0)") intv(used(1))
        case ("R", "r")
          used(2) = used(2) + 1
          write (value, "(g0.8)") realv(used(2))
        case ("S", "s")
          used(3) = used(3) + 1
          value = text_of(charv(:, used(3)))
        case default
          i = i - 1
        end select
      end if
      line(n + 1:) = value
      n = n + max(1, len_trim(value))
      i = i + 1
    end do
  end subroutine fill_in

  pure function text_of(characters) result(text)
    character(kind=c_char), intent(in) :: characters(:)
    character(size(characters)) :: text
    integer :: i

    do i = 1, size(characters)
      text(i:i) = characters(i)
    end do
  end function text_of

end module abaqus_utilities