!> Limit strains of a sheet by the method of Z. Marciniak and K. Kuczynski (Int. J. Mech. Sci. 9
!! (1967), 609-620) with any law: a thinner groove in a sheet that is strained in proportion.
!!
!! Sheet and groove are two points of the law in plane stress. Along the groove both strain alike,
!! and across it they bear the same force, so that the groove strains more; where it thins `many`
!! times as fast, or bears no more, the sheet is at its limit. The groove turns with the sheet; its
!! material axes do not turn against those of the sheet.
module forming_limit
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text
  use interrupt, only: is_stop_wanted
  use scene, only: material_test_spec_t
  use block_law, only: block_law_t
  use material_point, only: material_point_t, control_t, new_point, new_control, advance, &
                            strain_to_frame, stress_to_frame, stop_words, unmet_words
  implicit none
  private

  public :: find_limit, stress_at, ratio_of

  !> Where a proportional path ends.
  type, public :: limit_t
    real(wp) :: strain = 0.0_wp      !! major strain
    real(wp) :: groove = 0.0_wp      !! to its normal at the end, from the major strain [degrees]
    real(wp) :: stress(2) = 0.0_wp   !! principal stresses of the sheet in its plane, minor first
  end type limit_t

  character(*), parameter :: end_words = "the groove bears no more"
  real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp
  real(wp), parameter :: many = 10.0_wp            !! of the rates of thinning
  real(wp), parameter :: far = 3.0_wp              !! major strain at which the search ends
  real(wp), parameter :: least_ratio = -0.5_wp     !! minor over major strain, up to 1
  !> Grooves at the start, from across the major strain on, to the other side as well where the
  !! material is not the same there. Beyond zero minor strain the first is the worst.
  integer, parameter :: n_angles = 10
  real(wp), parameter :: angle_step = 5.0_wp       !! [degrees]
  !> Its components 33, 13 and 23; the others are strains.
  logical, parameter :: is_stress_of_sheet(6) = [.false., .false., .true., .false., .true., .true.]

contains

  !> Minor over major strain of one of the paths.
  pure real(wp) function ratio_of(i, n)
    integer, intent(in) :: i, n     !! number of the path, paths

    ratio_of = least_ratio + (1.0_wp - least_ratio)*(i - 1)/max(n - 1, 1)
  end function ratio_of

  !> Limit of a proportional path: that of the groove which fails first.
  subroutine find_limit(spec, law, ratio, limit, error)
    type(material_test_spec_t), intent(in) :: spec
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: ratio          !! minor over major strain
    type(limit_t), intent(out) :: limit
    type(error_t), allocatable, intent(out) :: error
    type(limit_t) :: reached
    integer :: i, first, last

    limit%strain = far
    last = merge(n_angles - 1, 0, ratio < 0.0_wp)
    first = merge(-last, 0, abs(modulo(spec%angle, 90.0_wp)) > 0.0_wp)
    do i = first, last
      call stretch(spec, law, ratio, angle_step*i*degree, limit%strain, reached, error)
      if (allocated(error)) return
      if (reached%strain < limit%strain) limit = reached
    end do
    if (limit%strain >= far) call fail(error, "the groove does not fail up to a strain of "// &
                                to_text(far)//" at the ratio "//to_text(ratio)//"; expected a "// &
                                "law whose hardening saturates, or a deeper groove")
  end subroutine find_limit

  !> Strain the sheet until a groove fails, or up to `most`.
  subroutine stretch(spec, law, ratio, start, most, limit, error)
    type(material_test_spec_t), intent(in) :: spec
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: ratio, start, most    !! start: angle of the groove [radians]
    type(limit_t), intent(out) :: limit
    type(error_t), allocatable, intent(out) :: error
    type(material_point_t) :: sheet, groove, before
    type(error_t), allocatable :: trouble
    type(control_t) :: control
    real(wp) :: aim(6), thinning, last, start_eqps, turned
    logical :: flows

    sheet = new_point(law, spec%state, spec%fields, is_plane=.true.)
    groove = sheet
    control = new_control(is_stress_of_sheet, degree*spec%angle)
    before = sheet
    turned = start
    last = 0.0_wp
    start_eqps = sheet%state(law%eqps_state)
    do
      if (is_stop_wanted()) call fail(error, stop_words//"; the rows up to there are kept")
      if (allocated(error)) return
      aim = spec%step*[1.0_wp, ratio, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
      call advance(law, control, aim, [0.0_wp, 0.0_wp, 0.0_wp], spec%step/spec%rate, sheet, error)
      if (allocated(error)) return
      turned = atan(tan(start)*exp((1.0_wp - ratio)*(limit%strain + spec%step)))
      call follow_sheet(spec, law, before, sheet, turned, last, groove, trouble)
      if (allocated(trouble)) then
        if (is_end_of_groove(trouble%message)) exit
        call fail(error, "in the groove: "//trouble%message)
        return
      end if
      thinning = sheet%strain(3) - before%strain(3)
      ! A groove that flows in a sheet which does not is no limit.
      flows = before%state(law%eqps_state) > start_eqps .and. &
              sheet%state(law%eqps_state) > before%state(law%eqps_state)
      if (flows .and. last < many*thinning) exit
      limit%strain = limit%strain + spec%step
      before = sheet
      if (limit%strain >= most) exit
    end do
    limit%groove = turned/degree
    limit%stress = plane_principal(before)
  end subroutine stretch

  !> Principal stresses of the sheet after strains in proportion, minor first.
  subroutine stress_at(spec, law, strains, stress, error)
    type(material_test_spec_t), intent(in) :: spec
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: strains(2)     !! minor and major strain
    real(wp), intent(out) :: stress(2)
    type(error_t), allocatable, intent(out) :: error
    type(material_point_t) :: sheet
    type(control_t) :: control
    real(wp) :: aim(6)
    integer :: i

    stress = 0.0_wp
    sheet = new_point(law, spec%state, spec%fields, is_plane=.true.)
    control = new_control(is_stress_of_sheet, degree*spec%angle)
    aim = [strains(2), strains(1), 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]/spec%n_increments
    do i = 1, spec%n_increments
      if (is_stop_wanted()) call fail(error, stop_words//"; the rows up to there are kept")
      if (allocated(error)) return
      call advance(law, control, aim, [0.0_wp, 0.0_wp, 0.0_wp], &
                   strains(2)/(spec%n_increments*spec%rate), sheet, error)
    end do
    if (.not. allocated(error)) stress = plane_principal(sheet)
  end subroutine stress_at

  !> Principal stresses of a point in plane stress, minor first.
  pure function plane_principal(point) result(values)
    type(material_point_t), intent(in) :: point
    real(wp) :: values(2)

    associate (stress => point%stress)
      values = 0.5_wp*(stress(1) + stress(2)) + [-1.0_wp, 1.0_wp] &
               *sqrt(0.25_wp*(stress(1) - stress(2))**2 + stress(4)**2)
    end associate
  end function plane_principal

  !> Does a failure say that the groove bears no more? Others are those of the law.
  pure logical function is_end_of_groove(message)
    character(*), intent(in) :: message

    is_end_of_groove = message == end_words .or. message == unmet_words
  end function is_end_of_groove

  !> One increment of the groove: the strain of the sheet along it, and across it the force of the
  !! sheet, for which its thickness is found by repetition. Fails where none bears that force.
  subroutine follow_sheet(spec, law, before, sheet, turned, last, groove, error)
    type(material_test_spec_t), intent(in) :: spec
    class(block_law_t), intent(in) :: law
    type(material_point_t), intent(in) :: before, sheet    !! at both ends of the increment
    real(wp), intent(in) :: turned
    real(wp), intent(inout) :: last        !! strain increment 33 of the groove, in: the last one
    type(material_point_t), intent(inout) :: groove
    type(error_t), allocatable, intent(out) :: error
    logical, parameter :: is_stress(6) = [.true., .false., .true., .true., .true., .true.]
    real(wp), parameter :: enough = 1.0e-6_wp      ! of the strain increment
    integer, parameter :: most_trials = 30
    type(material_point_t) :: start
    type(control_t) :: control
    real(wp) :: stress(6), strain(6), thickness, angle, guess, next, miss, guess_before, &
                miss_before
    integer :: i

    angle = degree*spec%angle + turned
    control = new_control(is_stress, angle)
    stress = matmul(stress_to_frame(angle), sheet%stress)
    strain = matmul(strain_to_frame(angle), sheet%strain - before%strain)
    start = groove
    guess = last
    guess_before = last
    miss_before = 0.0_wp
    do i = 1, most_trials
      groove = start
      thickness = spec%groove*exp(start%strain(3) + guess - sheet%strain(3))
      call advance(law, control, [stress(1)/thickness, strain(2), 0.0_wp, stress(4)/thickness, &
                                  0.0_wp, 0.0_wp], &
                   [0.0_wp, 0.0_wp, 0.0_wp], spec%step/spec%rate, groove, error)
      if (allocated(error)) return
      last = groove%strain(3) - start%strain(3)
      miss = last - guess
      if (abs(miss) <= enough*abs(last)) return
      ! Secants; the first step takes the answer.
      next = last
      if (i > 1 .and. abs(miss - miss_before) > 0.0_wp) &
        next = guess - miss*(guess - guess_before)/(miss - miss_before)
      guess_before = guess
      miss_before = miss
      guess = next
    end do
    call fail(error, end_words)
  end subroutine follow_sheet

end module forming_limit
